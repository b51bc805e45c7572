#include "app/standard_input.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

#include "app/interrupt.hpp"
#include "base/file.hpp"
#include "knap/error.hpp"
#include "pipeline/forecast.hpp"
#include "pipeline/identity.hpp"

namespace knap::app {

StandardInput::StandardInput(std::filesystem::path file) : file_(std::move(file)) {
    constexpr std::size_t kBlock = std::size_t{1} << 20;
    catch_interrupts();
    AtomicFile copy(file_, AtomicFile::Durability::kProcess);
    std::vector<std::byte> block(kBlock);
    for (;;) {
        const ssize_t got = ::read(STDIN_FILENO, block.data(), block.size());
        throw_if_interrupted();
        if (got < 0 && errno == EINTR) {
            continue;
        }
        if (got < 0) {
            throw InputError(
                fmt::format("-: cannot read standard input: {}", std::strerror(errno)));
        }
        if (got == 0) {
            break;
        }
        copy.write(std::span(block).first(static_cast<std::size_t>(got)));
    }
    copy.commit();
}

StandardInput::~StandardInput() {
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
}

std::unique_ptr<StandardInput> take_standard_input(Job& job, Progress& progress) {
    if (std::ranges::find(job.input, kStandardInput) == job.input.end()) {
        return nullptr;
    }
    job.standard_input = scratch_parent(job) / (scratch_name(job) + ".stdin");
    auto taken = std::make_unique<StandardInput>(job.standard_input);
    progress.note(fmt::format("standard input is read more than once: a copy of {} is in {}",
                              format_bytes(std::filesystem::file_size(job.standard_input)),
                              job.standard_input.string()));
    return taken;
}

}  // namespace knap::app

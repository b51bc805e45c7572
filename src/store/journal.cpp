#include "store/journal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <span>
#include <string_view>

#include "base/checksum.hpp"
#include "base/file.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

std::string checksum_of(std::string_view text) {
    return fmt::format("{:016x}", xxh3_64(std::as_bytes(std::span(text.data(), text.size()))));
}

std::optional<JournalEntry> parse(std::string_view line) {
    constexpr std::size_t kDigits = 16;
    if (line.size() <= kDigits || line[kDigits] != ' ' ||
        checksum_of(line.substr(kDigits + 1)) != line.substr(0, kDigits)) {
        return std::nullopt;
    }
    line.remove_prefix(kDigits + 1);
    const std::size_t first = line.find('\t');
    const std::size_t second = line.find('\t', first + 1);
    if (first == std::string_view::npos || second == std::string_view::npos) {
        return std::nullopt;
    }
    return JournalEntry{std::string(line.substr(0, first)),
                        std::string(line.substr(first + 1, second - first - 1)),
                        std::string(line.substr(second + 1))};
}

// A journal that cannot be read is the machine's fault, not the input's.
std::string read_all(const std::filesystem::path& path) {
    try {
        return read_text_file(path);
    } catch (const InputError& error) {
        throw StorageError(error.what());
    }
}

}  // namespace

void append_to_journal(const std::filesystem::path& path, const JournalEntry& entry) {
    const std::string text = fmt::format("{}\t{}\t{}", entry.stage, entry.file, entry.details);
    const std::string line = fmt::format("{} {}\n", checksum_of(text), text);
    append_to_file(path, std::as_bytes(std::span(line.data(), line.size())));
}

Journal read_journal(const std::filesystem::path& path) {
    Journal journal;
    if (!std::filesystem::exists(path)) {
        return journal;
    }
    const std::string text = read_all(path);
    std::string_view rest = text;
    while (!rest.empty()) {
        const std::size_t end = rest.find('\n');
        const bool torn = end == std::string_view::npos;
        const std::optional<JournalEntry> entry = torn ? std::nullopt : parse(rest.substr(0, end));
        if (!entry) {
            journal.damaged = !torn;
            break;
        }
        journal.entries.push_back(*entry);
        rest.remove_prefix(end + 1);
        journal.whole_bytes = text.size() - rest.size();
    }
    return journal;
}

}  // namespace knap

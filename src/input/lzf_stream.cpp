#include "input/lzf_stream.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "knap/error.hpp"

namespace knap {

LzfStream::LzfStream(const InputFile& file, std::uint64_t begin, std::uint64_t bytes)
    : file_(&file), reader_(file), end_(begin + bytes) {
    reader_.seek(begin);
}

void LzfStream::fail(const char* found) const {
    throw InputError(fmt::format("{}: expected LZF data up to byte {}, found {} at byte {}",
                                 file_->path().string(), end_, found, reader_.offset()));
}

std::uint8_t LzfStream::next_byte() {
    if (reader_.offset() >= end_) {
        fail("its end");
    }
    return std::to_integer<std::uint8_t>(*reader_.take(1));
}

void LzfStream::start_run() {
    constexpr unsigned kLongLength = 7;
    const unsigned control = next_byte();
    if (control < 32) {
        literals_ = control + 1;
        return;
    }
    unsigned length = control >> 5U;
    if (length == kLongLength) {
        length += next_byte();
    }
    match_ = length + 2;
    distance_ = ((control & 31U) << 8U) + next_byte() + 1;
    if (distance_ > produced_) {
        fail("a match from before the start");
    }
}

void LzfStream::read(std::span<std::byte> out) {
    for (std::size_t done = 0; done < out.size();) {
        if (literals_ == 0 && match_ == 0) {
            start_run();
        }
        const std::size_t n = std::min(out.size() - done, std::max(literals_, match_));
        if (literals_ > 0) {
            if (end_ - std::min(end_, reader_.offset()) < n) {
                fail("its end");
            }
            const std::byte* from = reader_.take(n);
            for (std::size_t i = 0; i < n; ++i) {
                put(from[i]);
                out[done + i] = from[i];
            }
            literals_ -= n;
        } else {
            // Byte by byte: a match may reach into what it produces.
            for (std::size_t i = 0; i < n; ++i) {
                const std::byte value = window_[(produced_ - distance_) % kReach];
                put(value);
                out[done + i] = value;
            }
            match_ -= n;
        }
        done += n;
    }
}

void LzfStream::skip(std::uint64_t bytes) {
    std::array<std::byte, 4096> scrap;
    while (bytes > 0) {
        const auto n = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, scrap.size()));
        read(std::span(scrap).first(n));
        bytes -= n;
    }
}

}  // namespace knap

#include "store/selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <span>

#include "base/checksum.hpp"
#include "base/file.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

static_assert(std::endian::native == std::endian::little, "files are little-endian");

constexpr std::array<char, 8> kMagic{'K', 'N', 'A', 'P', 'S', 'E', 'L', '\n'};
constexpr std::uint32_t kVersion = 1;

/// The first bytes of the file; size / 64 words, rounded up, follow.
struct Header {
    std::array<char, 8> magic = kMagic;
    std::uint32_t version = kVersion;
    std::uint32_t reserved = 0;
    std::uint64_t size = 0;             ///< bits
    std::uint64_t words_checksum = 0;   ///< XXH3-64 of the words
    std::uint64_t header_checksum = 0;  ///< XXH3-64 of the fields above
};
static_assert(sizeof(Header) == 40);

std::uint64_t checksum_of(const Header& header) {
    return xxh3_64(
        std::as_bytes(std::span(&header, 1)).first(sizeof(Header) - sizeof(std::uint64_t)));
}

std::uint64_t word_count(std::uint64_t size) {
    return size / 64 + (size % 64 != 0 ? 1 : 0);
}

[[noreturn]] void throw_corrupt(const std::filesystem::path& path, std::string_view expected,
                                std::string_view found) {
    throw StorageError(
        fmt::format("{}: selection: expected {}, found {}", path.string(), expected, found));
}

}  // namespace

Selection::Selection(std::uint64_t size) : size_(size), words_(word_count(size)) {
    finish();
}

void Selection::finish() {
    kept_before_block_.assign(words_.size() / kWordsPerBlock + 1, 0);
    count_ = 0;
    for (std::size_t i = 0; i < words_.size(); ++i) {
        if (i % kWordsPerBlock == 0) {
            kept_before_block_[i / kWordsPerBlock] = count_;
        }
        count_ += static_cast<std::uint64_t>(std::popcount(words_[i]));
    }
    if (words_.size() % kWordsPerBlock == 0) {
        kept_before_block_.back() = count_;
    }
}

std::uint64_t Selection::count_before(PointId id) const {
    const std::size_t word = id / 64;
    const std::size_t block = word / kWordsPerBlock;
    std::uint64_t count = kept_before_block_[block];
    for (std::size_t i = block * kWordsPerBlock; i < word; ++i) {
        count += static_cast<std::uint64_t>(std::popcount(words_[i]));
    }
    if (id % 64 != 0) {
        const std::uint64_t below = (std::uint64_t{1} << (id % 64)) - 1;
        count += static_cast<std::uint64_t>(std::popcount(words_[word] & below));
    }
    return count;
}

void Selection::save(const std::filesystem::path& path) const {
    Header header;
    header.size = size_;
    header.words_checksum = xxh3_64(std::as_bytes(std::span(words_)));
    header.header_checksum = checksum_of(header);
    AtomicFile file(path, AtomicFile::Durability::kProcess);
    file.write(std::as_bytes(std::span(&header, 1)));
    file.write(std::as_bytes(std::span(words_)));
    file.commit();
}

Selection Selection::load(const std::filesystem::path& path) {
    try {
        const InputFile file(path);
        Header header;
        if (file.read_some(0, std::as_writable_bytes(std::span(&header, 1))) != sizeof header) {
            throw_corrupt(path, "a header of 40 bytes", fmt::format("{} bytes", file.size()));
        }
        if (header.magic != kMagic || header.header_checksum != checksum_of(header)) {
            throw_corrupt(path, "the header of a selection", "other bytes");
        }
        if (header.version != kVersion) {
            throw_corrupt(path, fmt::format("version {}", kVersion),
                          fmt::to_string(header.version));
        }
        const std::uint64_t bytes = sizeof header + word_count(header.size) * sizeof(std::uint64_t);
        if (file.size() != bytes) {
            throw_corrupt(path, fmt::format("{} bytes", bytes),
                          fmt::format("{} bytes", file.size()));
        }
        Selection selection(header.size);
        const auto words = std::as_writable_bytes(std::span(selection.words_));
        if (file.read_some(sizeof header, words) != words.size() ||
            xxh3_64(words) != header.words_checksum) {
            throw_corrupt(path, "words that match their checksum", "other bytes");
        }
        selection.finish();
        return selection;
    } catch (const InputError& error) {
        throw StorageError(error.what());
    }
}

std::uint64_t Selection::memory_bytes(std::uint64_t size) {
    return word_count(size) * sizeof(std::uint64_t) * (kWordsPerBlock + 1) / kWordsPerBlock;
}

}  // namespace knap

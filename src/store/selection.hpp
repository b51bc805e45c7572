#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "knap/geometry.hpp"

namespace knap {

/// The ids that are kept: a bitmap of one bit an input point.
///
/// First set() in any order by one thread, then finish(); the questions may be asked by any number
/// of threads after that.
class Selection {
  public:
    Selection() = default;

    /// Nothing is kept.
    /// @param size  number of input points
    explicit Selection(std::uint64_t size);

    /// @param id  < size()
    void set(PointId id) { words_[id / 64] |= std::uint64_t{1} << (id % 64); }
    bool test(PointId id) const { return ((words_[id / 64] >> (id % 64)) & 1U) != 0; }

    std::uint64_t size() const { return size_; }

    /// Builds what count() and count_before() need; to be called after the last set().
    void finish();

    /// Number of kept ids.
    std::uint64_t count() const { return count_; }

    /// Number of kept ids below `id`: the rank of a kept id among all kept.
    /// @param id  <= size()
    std::uint64_t count_before(PointId id) const;

    /// Writes the bitmap: see docs/formats.md. Appears whole or not at all.
    /// @throws StorageError
    void save(const std::filesystem::path& path) const;

    /// Reads a bitmap and finishes it.
    /// @throws StorageError if the file is missing or is not what save() wrote
    static Selection load(const std::filesystem::path& path);

    /// Bytes of memory that a selection among `size` points takes.
    static std::uint64_t memory_bytes(std::uint64_t size);

    friend bool operator==(const Selection& a, const Selection& b) {
        return a.size_ == b.size_ && a.words_ == b.words_;
    }

  private:
    // One entry of the prefix table for this many words: 3 % more memory, at most 32 words to
    // count.
    static constexpr std::size_t kWordsPerBlock = 32;

    std::uint64_t size_ = 0;
    std::uint64_t count_ = 0;
    std::vector<std::uint64_t> words_;
    std::vector<std::uint64_t> kept_before_block_;
};

}  // namespace knap

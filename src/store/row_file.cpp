#include "store/row_file.hpp"

#include <algorithm>

namespace knap {

namespace {

constexpr std::size_t kBlockBytes = std::size_t{1} << 18;

ItemFormat format_of(std::size_t row_size) {
    return {"KNAPROWS", "row file", row_size};
}

}  // namespace

RowWriter::RowWriter(const std::filesystem::path& path, std::size_t row_size)
    : file_(path, format_of(row_size)),
      block_size_(std::max<std::size_t>(kBlockBytes / row_size, 1) * row_size) {}

void RowWriter::add(std::span<const std::byte> row) {
    rows_.insert(rows_.end(), row.begin(), row.end());
    if (rows_.size() == block_size_) {
        file_.add(rows_);
        rows_.clear();
    }
}

std::uint64_t RowWriter::finish() {
    if (!rows_.empty()) {
        file_.add(rows_);
    }
    return file_.finish();
}

RowReader::RowReader(const std::filesystem::path& path, std::size_t row_size)
    : file_(path, format_of(row_size)), row_size_(row_size) {}

std::span<const std::byte> RowReader::next() {
    if (rows_.empty()) {
        rows_ = file_.next();
        if (rows_.empty()) {
            file_.throw_damaged("expected one more row, found the end");
        }
    }
    const std::span<const std::byte> row = rows_.first(row_size_);
    rows_ = rows_.subspan(row_size_);
    return row;
}

}  // namespace knap

#include "input/pcd_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

#include "input/buffered_reader.hpp"
#include "input/bytes.hpp"
#include "input/columns.hpp"
#include "input/line_reader.hpp"
#include "input/lzf_stream.hpp"
#include "input/number.hpp"
#include "input/words.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

/// Is there nothing from here on but what some writers fill the last page of a file with?
bool only_filler_from(const InputFile& file, std::uint64_t begin) {
    constexpr std::uint64_t kLongest = std::uint64_t{1} << 16;
    const std::uint64_t bytes = file.size() - begin;
    std::vector<std::byte> filler(static_cast<std::size_t>(std::min(bytes, kLongest)));
    file.read_some(begin, filler);
    return bytes <= kLongest &&
           std::ranges::count(filler, std::byte{0}) == static_cast<std::ptrdiff_t>(filler.size());
}

/// A line a point.
class AsciiRows final : public PcdRows {
  public:
    AsciiRows(const InputFile& file, const PcdHeader& header)
        : file_(file), header_(header), lines_(file, header.data_offset, header.data_line) {
        // A value and what parts it from the next take two bytes; the last line may lack its end.
        std::uint64_t values = 0;
        for (const PcdField& field : header.fields) {
            values += field.count;
        }
        const std::uint64_t left = file.size() - header.data_offset;
        if (header.points > (left + 1) / (2 * values)) {
            throw InputError(fmt::format(
                "{}: the data ends early: expected {} points, found {} bytes, room for at most {}",
                file.path().string(), header.points, left, (left + 1) / (2 * values)));
        }
    }

    void want(const std::vector<bool>& wanted) override { wanted_ = wanted; }

    const std::byte* read(std::size_t points) override {
        rows_.resize(points * header_.stride);
        for (std::size_t i = 0; i < points; ++i) {
            std::string_view line;
            if (!lines_.next_with_text(line)) {
                throw InputError(
                    fmt::format("{}: the data ends early: expected {} points, found {}",
                                file_.path().string(), header_.points, next_));
            }
            parse(line, rows_.data() + i * header_.stride);
            ++next_;
        }
        return rows_.data();
    }

    void finish() override {
        std::string_view line;
        if (lines_.next_with_text(line)) {
            fail(fmt::format("the end of the file after {} points", header_.points), excerpt(line));
        }
    }

    void seek(std::uint64_t) override {}

  private:
    void parse(std::string_view line, std::byte* row) const {
        for (std::size_t i = 0; i < header_.fields.size(); ++i) {
            const PcdField& field = header_.fields[i];
            for (std::size_t k = 0; k < field.count; ++k) {
                const std::string_view word = take_word(line);
                if (word.empty()) {
                    fail(fmt::format("a value for each of {} fields", header_.fields.size()),
                         fmt::format("the end of the line before '{}'", field.name));
                }
                std::byte* to = row + field.offset + k * size_of(field.type);
                if (wanted_[i] && !parse_value(word, field.type, to)) {
                    fail(fmt::format("a value of type {} for '{}'", to_string(field.type),
                                     field.name),
                         excerpt(word));
                }
            }
        }
        if (const std::string_view extra = take_word(line); !extra.empty()) {
            fail("the end of the line", excerpt(extra));
        }
    }

    [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
        throw InputError(fmt::format("{}: line {}: expected {}, found {}", file_.path().string(),
                                     lines_.line_number(), expected, found));
    }

    const InputFile& file_;
    const PcdHeader& header_;
    LineReader lines_;
    std::vector<bool> wanted_;
    std::vector<std::byte> rows_;
    std::uint64_t next_ = 0;
};

/// The records as they are.
class BinaryRows final : public PcdRows {
  public:
    BinaryRows(const InputFile& file, const PcdHeader& header) : header_(header), reader_(file) {
        const std::uint64_t room = file.size() - header.data_offset;
        if (header.points > room / header.stride ||
            !only_filler_from(file, header.data_offset + header.points * header.stride)) {
            throw InputError(fmt::format(
                "{}: expected {} points of {} bytes from byte {} as the PCD header says, found {} "
                "bytes",
                file.path().string(), header.points, header.stride, header.data_offset, room));
        }
        seek(0);
    }

    void want(const std::vector<bool>&) override {}

    const std::byte* read(std::size_t points) override {
        return reader_.take(points * header_.stride);
    }

    void finish() override {}

    void seek(std::uint64_t index) override {
        reader_.seek(header_.data_offset + index * header_.stride);
    }

  private:
    const PcdHeader& header_;
    BufferedReader reader_;
};

/// One field of all points after the other, all of it LZF: a stream stands in each field wanted.
class CompressedRows final : public PcdRows {
  public:
    CompressedRows(const InputFile& file, const PcdHeader& header) : file_(file), header_(header) {
        constexpr std::size_t kSizes = 8;
        std::array<std::byte, kSizes> sizes{};
        const std::size_t got = file.read_some(header.data_offset, sizes);
        begin_ = header.data_offset + kSizes;
        bytes_ = load_little<std::uint32_t>(sizes.data());
        const std::uint64_t left = file.size() - header.data_offset - got;
        if (got < kSizes || left < bytes_ || !only_filler_from(file, begin_ + bytes_)) {
            throw InputError(
                fmt::format("{}: expected {} bytes of compressed data from byte {}, found {}",
                            file.path().string(), bytes_, begin_, left));
        }
        const std::uint64_t unpacked = load_little<std::uint32_t>(sizes.data() + 4);
        for (const PcdField& field : header.fields) {
            packed_stride_ += field.is_padding() ? 0 : field.size();
        }
        // Whether what is there for its place only is left out depends on the writer.
        has_padding_ = unpacked != header.points * packed_stride_;
        if (has_padding_ && unpacked != header.points * header.stride) {
            throw InputError(fmt::format(
                "{}: expected {} points of {} bytes in the compressed data, found {} bytes",
                file.path().string(), header.points, packed_stride_, unpacked));
        }
    }

    void want(const std::vector<bool>& wanted) override {
        wanted_ = wanted;
        streams_.clear();
    }

    const std::byte* read(std::size_t points) override {
        if (streams_.empty()) {
            start();
        }
        rows_.resize(points * header_.stride);
        for (FieldStream& stream : streams_) {
            const std::size_t size = stream.field->size();
            values_.resize(points * size);
            stream.data.read(values_);
            std::byte* to = rows_.data() + stream.field->offset;
            for (std::size_t i = 0; i < points; ++i, to += header_.stride) {
                std::memcpy(to, values_.data() + i * size, size);
            }
        }
        next_ += points;
        return rows_.data();
    }

    void finish() override {}
    void seek(std::uint64_t) override {}

  private:
    struct FieldStream {
        const PcdField* field;
        LzfStream data;
    };

    /// Goes over the data once and leaves a stream behind in each field that is wanted.
    void start() {
        const auto last = std::find(wanted_.rbegin(), wanted_.rend(), true);
        const auto fields = static_cast<std::size_t>(wanted_.rend() - last);
        LzfStream data(file_, begin_, bytes_);
        std::uint64_t ahead = 0;
        for (std::size_t i = 0; i < fields; ++i) {
            const PcdField& field = header_.fields[i];
            if (field.is_padding() && !has_padding_) {
                continue;
            }
            if (wanted_[i]) {
                data.skip(ahead);
                ahead = 0;
                streams_.push_back({&field, data});
                streams_.back().data.skip(next_ * field.size());
            }
            ahead += header_.points * field.size();
        }
    }

    const InputFile& file_;
    const PcdHeader& header_;
    std::uint64_t begin_ = 0;
    std::uint64_t bytes_ = 0;
    std::size_t packed_stride_ = 0;  // bytes of a point without padding
    bool has_padding_ = false;
    std::vector<bool> wanted_;
    std::vector<FieldStream> streams_;
    std::vector<std::byte> rows_;
    std::vector<std::byte> values_;
    std::uint64_t next_ = 0;
};

}  // namespace

std::unique_ptr<PcdRows> open_pcd_rows(const InputFile& file, const PcdHeader& header) {
    switch (header.encoding) {
        case PcdEncoding::kAscii:
            return std::make_unique<AsciiRows>(file, header);
        case PcdEncoding::kBinary:
            return std::make_unique<BinaryRows>(file, header);
        case PcdEncoding::kCompressed:
            break;
    }
    return std::make_unique<CompressedRows>(file, header);
}

}  // namespace knap

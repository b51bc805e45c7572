#include "input/las_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <string_view>

#include "input/bytes.hpp"
#include "input/number.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::array<std::uint16_t, 5> kHeaderSizes{227, 227, 227, 235, 375};  // of LAS 1.0 to 1.4
constexpr std::array<std::uint16_t, 11> kRecordLengths{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
constexpr std::size_t kLongestHeader = 375;
constexpr int kNewestMinor = 5;

// Offsets in the public header block and in the head of a variable-length record.
constexpr std::size_t kGlobalEncoding = 6, kVersion = 24, kHeaderSize = 94, kPointsOffset = 96,
                      kVlrCount = 100, kPointFormat = 104, kRecordLength = 105, kLegacyCount = 107,
                      kScale = 131, kOffset = 155, kWaveformStart = 227, kEvlrStart = 235,
                      kEvlrCount = 243, kCount = 247;
constexpr std::size_t kVlrHead = 54, kEvlrHead = 60, kUserId = 2, kUserIdSize = 16, kRecordId = 18,
                      kRecordSize = 20, kVlrDescription = 22, kEvlrDescription = 28,
                      kDescriptionSize = 32;

class HeaderBytes {
  public:
    explicit HeaderBytes(const InputFile& file) : file_(file) { size_ = file.read_some(0, bytes_); }

    template <typename T>
    T get(std::size_t offset) const {
        return load_little<T>(bytes_.data() + offset);
    }

    void expect_size(std::size_t needed) const {
        if (size_ < needed) {
            fail(fmt::format("a LAS header of at least {} bytes", needed),
                 fmt::format("a file of {} bytes", file_.size()));
        }
    }

    void expect_signature() const {
        const std::string_view found(reinterpret_cast<const char*>(bytes_.data()),
                                     std::min<std::size_t>(size_, 4));
        if (found != "LASF") {
            fail("'LASF' at byte 0", excerpt(found));
        }
    }

    [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
        throw InputError(fmt::format("{}: LAS header: expected {}, found {}", file_.path().string(),
                                     expected, found));
    }

  private:
    const InputFile& file_;
    std::array<std::byte, kLongestHeader> bytes_{};
    std::size_t size_ = 0;
};

/// The number of points, which LAS 1.4 on may give twice.
std::uint64_t read_count(const HeaderBytes& bytes, int version_minor) {
    const std::uint64_t legacy = bytes.get<std::uint32_t>(kLegacyCount);
    const std::uint64_t count = version_minor >= 4 ? bytes.get<std::uint64_t>(kCount) : 0;
    if (legacy != 0 && count != 0 && legacy != count) {
        bytes.fail("one number of points",
                   fmt::format("{} in the extended and {} in the legacy field", count, legacy));
    }
    return count != 0 ? count : legacy;
}

Vec3 read_vector(const HeaderBytes& bytes, std::size_t offset) {
    return {bytes.get<double>(offset), bytes.get<double>(offset + 8),
            bytes.get<double>(offset + 16)};
}

void check_points(const HeaderBytes& bytes, const InputFile& file, const LasHeader& header) {
    if (header.points_offset < header.header_size || header.points_offset > file.size()) {
        bytes.fail(fmt::format("points between byte {} and the end of the file at {}",
                               header.header_size, file.size()),
                   fmt::format("their offset {}", header.points_offset));
    }
    const std::uint16_t shortest = las_record_length(header.point_format);
    if (header.record_length < shortest) {
        bytes.fail(
            fmt::format("at least {} bytes a point of format {}", shortest, header.point_format),
            fmt::format("{}", header.record_length));
    }
    for (int axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(header.scale[axis]) || header.scale[axis] == 0) {
            bytes.fail(fmt::format("a finite scale of {} other than 0", "xyz"[axis]),
                       fmt::format("{}", header.scale[axis]));
        }
        if (!std::isfinite(header.offset[axis])) {
            bytes.fail(fmt::format("a finite offset of {}", "xyz"[axis]),
                       fmt::format("{}", header.offset[axis]));
        }
    }
}

/// Lists up to `count` records in [begin, end).
void list_records(const InputFile& file, std::uint64_t begin, std::uint64_t end,
                  std::uint64_t count, bool extended, std::vector<LasRecord>& records) {
    const std::size_t head_size = extended ? kEvlrHead : kVlrHead;
    std::array<std::byte, kEvlrHead> head{};
    for (std::uint64_t i = 0; i < count && end - begin >= head_size; ++i) {
        if (file.read_some(begin, std::span(head).first(head_size)) < head_size) {
            return;
        }
        LasRecord record;
        const char* user_id = reinterpret_cast<const char*>(head.data() + kUserId);
        record.user_id.assign(user_id, ::strnlen(user_id, kUserIdSize));
        record.id = load_little<std::uint16_t>(head.data() + kRecordId);
        record.extended = extended;
        const char* description = reinterpret_cast<const char*>(
            head.data() + (extended ? kEvlrDescription : kVlrDescription));
        record.description.assign(description, ::strnlen(description, kDescriptionSize));
        record.offset = begin + head_size;
        record.length = extended ? load_little<std::uint64_t>(head.data() + kRecordSize)
                                 : load_little<std::uint16_t>(head.data() + kRecordSize);
        if (record.length > end - record.offset) {
            return;
        }
        begin = record.offset + record.length;
        records.push_back(std::move(record));
    }
}

}  // namespace

std::uint16_t las_record_length(int point_format) {
    return kRecordLengths.at(static_cast<std::size_t>(point_format));
}

LasHeader read_las_header(const InputFile& file) {
    const HeaderBytes bytes(file);
    bytes.expect_signature();
    bytes.expect_size(kHeaderSizes[0]);
    LasHeader header;
    const int major = bytes.get<std::uint8_t>(kVersion);
    header.version_minor = bytes.get<std::uint8_t>(kVersion + 1);
    if (major != 1 || header.version_minor > kNewestMinor) {
        bytes.fail(fmt::format("version 1.0 to 1.{}", kNewestMinor),
                   fmt::format("{}.{}", major, header.version_minor));
    }
    const std::uint16_t shortest = kHeaderSizes[static_cast<std::size_t>(
        std::min<int>(header.version_minor, kHeaderSizes.size() - 1))];
    bytes.expect_size(shortest);
    header.header_size = bytes.get<std::uint16_t>(kHeaderSize);
    if (header.header_size < shortest) {
        bytes.fail(
            fmt::format("a size of at least {} for LAS 1.{}", shortest, header.version_minor),
            fmt::format("{}", header.header_size));
    }
    header.global_encoding = bytes.get<std::uint16_t>(kGlobalEncoding);
    header.points_offset = bytes.get<std::uint32_t>(kPointsOffset);
    header.vlr_count = bytes.get<std::uint32_t>(kVlrCount);
    // The two high bits are LAZ's: 10 means compressed.
    const int format = bytes.get<std::uint8_t>(kPointFormat);
    header.compressed = (format & 0xc0) == 0x80;
    header.point_format = header.compressed ? format & 0x3f : format;
    if (header.point_format >= static_cast<int>(kRecordLengths.size())) {
        bytes.fail(fmt::format("point format 0 to {}", kRecordLengths.size() - 1),
                   fmt::format("{}", header.point_format));
    }
    header.record_length = bytes.get<std::uint16_t>(kRecordLength);
    header.count = read_count(bytes, header.version_minor);
    header.scale = read_vector(bytes, kScale);
    header.offset = read_vector(bytes, kOffset);
    if (header.version_minor >= 3) {
        header.waveform_start = bytes.get<std::uint64_t>(kWaveformStart);
    }
    if (header.version_minor >= 4) {
        header.evlr_start = bytes.get<std::uint64_t>(kEvlrStart);
        header.evlr_count = bytes.get<std::uint32_t>(kEvlrCount);
    }
    check_points(bytes, file, header);
    return header;
}

std::vector<LasRecord> list_las_records(const InputFile& file, const LasHeader& header) {
    std::vector<LasRecord> records;
    list_records(file, header.header_size, header.points_offset, header.vlr_count, false, records);
    if (header.evlr_start >= header.points_offset && header.evlr_start <= file.size()) {
        list_records(file, header.evlr_start, file.size(), header.evlr_count, true, records);
    }
    return records;
}

std::vector<std::byte> read_las_record(const InputFile& file, const LasRecord& record,
                                       std::size_t most) {
    std::vector<std::byte> content(
        static_cast<std::size_t>(std::min<std::uint64_t>(record.length, most)));
    content.resize(file.read_some(record.offset, content));
    return content;
}

}  // namespace knap

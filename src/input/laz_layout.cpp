#include "input/laz_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "input/bytes.hpp"
#include "input/laz_chunk_table.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

// The LASzip record: 34 bytes, then the items of a point, each a type, size and version.
constexpr std::size_t kCompressor = 0, kCoder = 2, kChunkSize = 12, kItemCount = 32, kItems = 34,
                      kItemSize = 6;
constexpr std::uint32_t kVariableChunks = 0xffffffff;
constexpr std::size_t kTableHead = 8;

/// An item and the versions of its coding that LASzip knows.
struct Item {
    std::uint16_t type;
    std::uint16_t size;
    std::uint16_t oldest;
    std::uint16_t newest;
};
constexpr Item kPoint10{6, 20, 1, 2}, kGpsTime11{7, 8, 1, 2}, kRgb12{8, 6, 1, 2},
    kWavepacket13{9, 29, 1, 1}, kPoint14{10, 30, 2, 4}, kRgb14{11, 6, 2, 4}, kRgbNir14{12, 8, 2, 4},
    kWavepacket14{13, 29, 3, 4};
constexpr std::uint16_t kByte = 0, kByte14 = 14;

class Layout {
  public:
    Layout(const InputFile& file, const LasHeader& header) : file_(file), header_(header) {}

    LazLayout read(std::span<const LasRecord> records);

  private:
    [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
        throw InputError(
            fmt::format("{}: LAZ: expected {}, found {}", file_.path().string(), expected, found));
    }

    std::vector<Item> expected_items() const;
    void check_record();
    std::uint64_t table_place() const;
    void read_chunks();
    std::vector<LazTableEntry> read_table(std::uint64_t place) const;

    std::uint32_t chunk_size() const {
        return load_little<std::uint32_t>(layout_.record.data() + kChunkSize);
    }

    const InputFile& file_;
    const LasHeader& header_;
    LazLayout layout_;
};

std::vector<Item> Layout::expected_items() const {
    static const std::array<std::vector<Item>, 11> kOfFormat{{
        {kPoint10},
        {kPoint10, kGpsTime11},
        {kPoint10, kRgb12},
        {kPoint10, kGpsTime11, kRgb12},
        {kPoint10, kGpsTime11, kWavepacket13},
        {kPoint10, kGpsTime11, kRgb12, kWavepacket13},
        {kPoint14},
        {kPoint14, kRgb14},
        {kPoint14, kRgbNir14},
        {kPoint14, kWavepacket14},
        {kPoint14, kRgbNir14, kWavepacket14},
    }};
    std::vector<Item> items = kOfFormat[static_cast<std::size_t>(header_.point_format)];
    const auto extra =
        static_cast<std::uint16_t>(header_.record_length - las_record_length(header_.point_format));
    if (extra > 0) {
        items.push_back(header_.point_format <= 5 ? Item{kByte, extra, 1, 2}
                                                  : Item{kByte14, extra, 2, 4});
    }
    return items;
}

/// LASzip builds its decoder from these items: anything but those of the point format is refused
/// before it sees them.
void Layout::check_record() {
    const std::vector<std::byte>& record = layout_.record;
    if (record.size() < kItems) {
        fail(fmt::format("a LASzip record of at least {} bytes", kItems),
             fmt::format("{}", record.size()));
    }
    layout_.compressor = load_little<std::uint16_t>(record.data() + kCompressor);
    const bool is_new = header_.point_format >= 6;
    const bool fits = is_new ? layout_.compressor == LazLayout::kLayered
                             : layout_.compressor == LazLayout::kUnchunked ||
                                   layout_.compressor == LazLayout::kChunked;
    if (!fits || load_little<std::uint16_t>(record.data() + kCoder) != 0) {
        fail(fmt::format("a compressor of point format {}", header_.point_format),
             fmt::format("compressor {}, coder {}", layout_.compressor,
                         load_little<std::uint16_t>(record.data() + kCoder)));
    }
    const std::vector<Item> expected = expected_items();
    const std::size_t count = load_little<std::uint16_t>(record.data() + kItemCount);
    bool agree = count == expected.size() && record.size() == kItems + count * kItemSize;
    for (std::size_t i = 0; agree && i < count; ++i) {
        const auto field = [&](std::size_t which) {
            return load_little<std::uint16_t>(record.data() + kItems + i * kItemSize + 2 * which);
        };
        agree = field(0) == expected[i].type && field(1) == expected[i].size &&
                field(2) >= expected[i].oldest && field(2) <= expected[i].newest;
    }
    if (!agree) {
        fail(fmt::format("the {} items of point format {} with records of {} bytes",
                         expected.size(), header_.point_format, header_.record_length),
             fmt::format("{} others in a LASzip record of {} bytes", count, record.size()));
    }
    if (layout_.compressor == LazLayout::kLayered) {
        for (const Item& item : expected) {
            layout_.layers += item.type == kPoint14.type    ? 9
                              : item.type == kRgbNir14.type ? 2
                              : item.type == kByte14        ? item.size
                                                            : 1;
        }
    }
}

std::uint64_t Layout::table_place() const {
    std::array<std::byte, 8> bytes{};
    const std::uint64_t first_chunk = header_.points_offset + bytes.size();
    if (first_chunk + kTableHead > file_.size()) {
        fail("a chunk table", "the end of the file");
    }
    file_.read_some(header_.points_offset, bytes);
    auto place = load_little<std::int64_t>(bytes.data());
    if (place == -1) {
        // Written to a pipe: the place is the last thing in the file.
        file_.read_some(file_.size() - bytes.size(), bytes);
        place = load_little<std::int64_t>(bytes.data());
    }
    const auto unsigned_place = static_cast<std::uint64_t>(place);
    if (unsigned_place < first_chunk || unsigned_place > file_.size() - kTableHead) {
        fail(fmt::format("a chunk table between bytes {} and {}", first_chunk,
                         file_.size() - kTableHead),
             fmt::format("its place {}: the file is truncated or its writer was interrupted",
                         place));
    }
    return unsigned_place;
}

std::vector<LazTableEntry> Layout::read_table(std::uint64_t place) const {
    std::array<std::byte, kTableHead> head{};
    file_.read_some(place, head);
    const auto version = load_little<std::uint32_t>(head.data());
    const auto chunks = load_little<std::uint32_t>(head.data() + 4);
    // The first point of a chunk is stored as it is.
    const std::uint64_t most = (place - header_.points_offset) / header_.record_length;
    if (version != 0 || chunks > most) {
        fail(fmt::format("a chunk table of version 0 with at most {} chunks at byte {}", most,
                         place),
             fmt::format("version {} with {}", version, chunks));
    }
    // No entry takes more bytes: two numbers of 32 bits, each behind a class and a place.
    constexpr std::uint64_t kLongestEntry = 16;
    const std::uint64_t begin = place + kTableHead;
    std::vector<std::byte> coded(static_cast<std::size_t>(
        std::min<std::uint64_t>(file_.size() - begin, (chunks + 1) * kLongestEntry)));
    coded.resize(file_.read_some(begin, coded));
    std::vector<LazTableEntry> table =
        chunks == 0 ? std::vector<LazTableEntry>()
                    : decode_laz_chunk_table(coded, chunks, chunk_size() == kVariableChunks);
    if (table.size() != chunks) {
        fail(fmt::format("a chunk table of {} entries at byte {}", chunks, place),
             fmt::format("{} before the end of the file", table.size()));
    }
    return table;
}

void Layout::read_chunks() {
    const std::uint32_t size = chunk_size();
    if (size == 0) {
        fail("chunks of at least 1 point", "0");
    }
    const std::uint64_t place = table_place();
    const std::vector<LazTableEntry> table = read_table(place);
    std::uint64_t begin = header_.points_offset + 8;
    std::uint64_t points = 0;
    for (std::size_t i = 0; i < table.size(); ++i) {
        LazChunk chunk{.first = points,
                       .points = table[i].points,
                       .begin = begin,
                       .end = begin + table[i].bytes};
        if (size != kVariableChunks) {
            // Only the last chunk may be short: it has what the others leave.
            const bool is_last = i + 1 == table.size();
            chunk.points = is_last && header_.count > points ? header_.count - points : size;
            if (chunk.points > size) {
                break;
            }
        }
        begin = chunk.end;
        points += chunk.points;
        if (chunk.points > 0) {
            layout_.chunks.push_back(chunk);
        }
    }
    if (points != header_.count) {
        fail(fmt::format("{} points as the header says", header_.count),
             fmt::format("{} chunks of {} points in the chunk table", table.size(),
                         size == kVariableChunks ? fmt::format("together {}", points)
                                                 : fmt::format("at most {}", size)));
    }
    if (begin != place) {
        fail(fmt::format("chunks that end at the chunk table, byte {}", place),
             fmt::format("their end at byte {}", begin));
    }
    if (!layout_.chunks.empty()) {
        const std::uint64_t chunks = layout_.chunks.size();
        layout_.typical_points =
            size != kVariableChunks ? size : (header_.count + chunks - 1) / chunks;
    }
}

LazLayout Layout::read(std::span<const LasRecord> records) {
    constexpr std::uint16_t kLaszipRecord = 22204;
    const auto record = std::ranges::find_if(records, [](const LasRecord& r) {
        return r.user_id == "laszip encoded" && r.id == kLaszipRecord;
    });
    if (record == records.end()) {
        fail("a record 'laszip encoded' that says how points are compressed", "none");
    }
    layout_.record = read_las_record(file_, *record, static_cast<std::size_t>(record->length));
    check_record();
    if (header_.count == 0 && file_.size() < header_.points_offset + 8 + kTableHead) {
        return std::move(layout_);
    }
    if (layout_.compressor != LazLayout::kUnchunked) {
        read_chunks();
    } else if (header_.count > 0) {
        layout_.chunks.push_back({.first = 0,
                                  .points = header_.count,
                                  .begin = header_.points_offset,
                                  .end = file_.size()});
    }
    return std::move(layout_);
}

}  // namespace

LazLayout read_laz_layout(const InputFile& file, const LasHeader& header,
                          std::span<const LasRecord> records) {
    return Layout(file, header).read(records);
}

void check_laz_chunk(const InputFile& file, const LasHeader& header, const LazLayout& layout,
                     const LazChunk& chunk) {
    if (layout.compressor != LazLayout::kLayered) {
        return;
    }
    // The first point, the number of points, the bytes of each layer, then the layers.
    std::vector<std::byte> head(header.record_length + 4 * (1 + layout.layers));
    const std::size_t got = file.read_some(chunk.begin, head);
    const std::byte* numbers = head.data() + header.record_length;
    std::uint64_t bytes = head.size();
    for (std::size_t i = 0; i < layout.layers; ++i) {
        bytes += load_little<std::uint32_t>(numbers + 4 * (1 + i));
    }
    const auto points = load_little<std::uint32_t>(numbers);
    if (got < head.size() || points != chunk.points || bytes != chunk.end - chunk.begin) {
        throw InputError(fmt::format(
            "{}: LAZ: expected {} points in {} bytes in the chunk at byte {}, found {} in {}",
            file.path().string(), chunk.points, chunk.end - chunk.begin, chunk.begin, points,
            bytes));
    }
}

}  // namespace knap

#include "input/las_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "input/buffered_reader.hpp"
#include "input/bytes.hpp"
#include "input/las_header.hpp"
#include "input/las_info.hpp"
#include "input/laz_source.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

/// End of the bytes that can hold points: what the header places behind them begins there.
std::uint64_t points_limit(const InputFile& file, const LasHeader& header) {
    constexpr std::uint16_t kWaveformsInside = 1 << 1;
    std::uint64_t limit = file.size();
    const auto bound = [&](std::uint64_t start) {
        if (start >= header.points_offset && start < limit) {
            limit = start;
        }
    };
    if (header.evlr_count > 0) {
        bound(header.evlr_start);
    }
    if ((header.global_encoding & kWaveformsInside) != 0 && header.waveform_start != 0) {
        bound(header.waveform_start);
    }
    return limit;
}

/// Does an extended variable-length record begin here? Versions before 1.4 have no field that
/// says so; indices of other tools and waveforms are appended this way.
bool looks_like_record(const InputFile& file, std::uint64_t begin, std::uint64_t end) {
    constexpr std::size_t kHead = 60, kUserId = 2, kUserIdEnd = 18, kLength = 20;
    std::array<std::byte, kHead> head{};
    if (file.read_some(begin, head) < kHead) {
        return false;
    }
    const auto user_id = std::span(head).subspan(kUserId, kUserIdEnd - kUserId);
    const auto name_end = std::ranges::find(user_id, std::byte{0});
    const auto is_printable = [](std::byte b) {
        return b >= std::byte{0x20} && b < std::byte{0x7f};
    };
    return name_end - user_id.begin() >= 3 &&
           std::all_of(user_id.begin(), name_end, is_printable) &&
           std::all_of(name_end, user_id.end(), [](std::byte b) { return b == std::byte{0}; }) &&
           load_little<std::uint64_t>(head.data() + kLength) <= end - begin - kHead;
}

void check_count(const InputFile& file, const LasHeader& header) {
    const std::uint64_t limit = points_limit(file, header);
    const std::uint64_t room = limit - header.points_offset;
    const std::uint64_t held = room / header.record_length;
    bool agrees = header.count <= held;
    if (header.count < held) {
        const std::uint64_t expected_end =
            header.points_offset + header.count * header.record_length;
        agrees = looks_like_record(file, expected_end, limit);
    }
    if (!agrees) {
        throw InputError(
            fmt::format("{}: expected {} points of {} bytes from byte {} as the LAS header says, "
                        "found {} bytes: {} points",
                        file.path().string(), header.count, header.record_length,
                        header.points_offset, room, held));
    }
}

class LasSource final : public PointSource {
  public:
    LasSource(InputFile file, const LasHeader& header, std::vector<LasField> fields,
              SourceInfo info)
        : file_(std::move(file)),
          header_(header),
          fields_(std::move(fields)),
          info_(std::move(info)),
          reader_(file_) {
        reader_.seek(header_.points_offset);
    }

    const SourceInfo& info() const override { return info_; }

    void select(std::span<const std::size_t> attributes) override {
        selection_.select(info_, attributes);
    }

    bool read(Chunk& chunk, std::size_t max_points) override {
        const auto wanted =
            static_cast<std::size_t>(std::min<std::uint64_t>(header_.count - next_, max_points));
        chunk.first = next_;
        chunk.positions.resize(wanted);
        selection_.resize(chunk, wanted);
        const std::size_t block = BufferedReader::kCapacity / header_.record_length;
        for (std::size_t done = 0; done < wanted;) {
            const std::size_t n = std::min(block, wanted - done);
            const std::byte* records = reader_.take(n * header_.record_length);
            decode(records, n, chunk.positions.data() + done);
            take_las_columns(fields_, selection_, records, n, header_.record_length, chunk, done);
            done += n;
        }
        next_ += wanted;
        return wanted > 0;
    }

    void seek(std::uint64_t index) override {
        if (index > header_.count) {
            throw InputError(fmt::format("{}: cannot seek to point {} of {}", file_.path().string(),
                                         index, header_.count));
        }
        next_ = index;
        reader_.seek(header_.points_offset + index * header_.record_length);
    }

  private:
    /// Every point format begins with the three coordinates.
    void decode(const std::byte* from, std::size_t n, Vec3* to) const {
        for (std::size_t i = 0; i < n; ++i, from += header_.record_length) {
            to[i] = {axes_[0].at(load_little<std::int32_t>(from)),
                     axes_[1].at(load_little<std::int32_t>(from + 4)),
                     axes_[2].at(load_little<std::int32_t>(from + 8))};
        }
    }

    InputFile file_;
    LasHeader header_;
    std::vector<LasField> fields_;
    SourceInfo info_;
    ColumnSelection selection_;
    std::array<GridAxis, 3> axes_{GridAxis(header_.scale.x, header_.offset.x),
                                  GridAxis(header_.scale.y, header_.offset.y),
                                  GridAxis(header_.scale.z, header_.offset.z)};
    BufferedReader reader_;
    std::uint64_t next_ = 0;
};

}  // namespace

std::unique_ptr<PointSource> open_las(InputFile file) {
    const LasHeader header = read_las_header(file);
    const std::vector<LasRecord> records = list_las_records(file, header);
    std::vector<LasField> fields = las_fields(file, header, records);
    SourceInfo info = describe_las(file, header, records, fields);
    if (header.compressed) {
        return open_laz(std::move(file), header, records, std::move(fields), std::move(info));
    }
    check_count(file, header);
    info.seek_granularity = 1;
    return std::make_unique<LasSource>(std::move(file), header, std::move(fields), std::move(info));
}

}  // namespace knap

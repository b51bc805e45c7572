#include "input/laz_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "input/laz_decoder.hpp"
#include "input/laz_layout.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

class LazSource final : public PointSource {
  public:
    LazSource(InputFile file, const LasHeader& header, std::vector<LasField> fields,
              LazLayout layout, SourceInfo info)
        : file_(std::move(file)),
          header_(header),
          fields_(std::move(fields)),
          layout_(std::move(layout)),
          info_(std::move(info)) {
        info_.seek_granularity = layout_.typical_points;
    }

    const SourceInfo& info() const override { return info_; }

    void select(std::span<const std::size_t> attributes) override {
        selection_.select(info_, attributes);
        layers_ = {};
        for (const std::size_t attribute : attributes) {
            layers_.set(static_cast<std::size_t>(fields_[attribute].layer));
        }
        decoder_.reset();  // it decodes the layers it was opened for
    }

    bool read(Chunk& chunk, std::size_t max_points) override {
        const auto wanted =
            static_cast<std::size_t>(std::min<std::uint64_t>(header_.count - next_, max_points));
        chunk.first = next_;
        chunk.positions.resize(wanted);
        selection_.resize(chunk, wanted);
        for (std::size_t done = 0; done < wanted;) {
            const std::span<const LasIndex> block = read_block(wanted - done);
            take_las_columns(fields_, selection_, records_.data(), block.size(),
                             header_.record_length, chunk, done);
            for (const LasIndex& index : block) {
                chunk.positions[done++] = {axes_[0].at(index.x), axes_[1].at(index.y),
                                           axes_[2].at(index.z)};
            }
        }
        return wanted > 0;
    }

    void seek(std::uint64_t index) override {
        if (info_.seek_granularity == 0 || index > header_.count) {
            throw InputError(fmt::format("{}: cannot seek to point {} of {}", file_.path().string(),
                                         index, header_.count));
        }
        if (index != next_) {
            decoder_.reset();
            next_ = index;
        }
    }

  private:
    static constexpr std::size_t kBlock = 4096;

    /// The next points, at least one and at most `most`.
    std::span<const LasIndex> read_block(std::size_t most) {
        if (!decoder_ || decoder_->remaining() == 0) {
            start_chunk();
        }
        const std::span<const LasIndex> block = decode(most);
        next_ += block.size();
        return block;
    }

    std::span<const LasIndex> decode(std::uint64_t most) {
        most = std::min({most, decoder_->remaining(), std::uint64_t{kBlock}});
        block_.resize(static_cast<std::size_t>(most));
        if (selection_.empty()) {
            decoder_->read(block_);
        } else {
            records_.resize(block_.size() * header_.record_length);
            decoder_->read(block_, records_);
        }
        return block_;
    }

    /// Opens the chunk of point next_ and goes over the points before it.
    void start_chunk() {
        const auto behind = std::ranges::upper_bound(layout_.chunks, next_, {}, &LazChunk::first);
        const LazChunk& chunk = *std::prev(behind);
        check_laz_chunk(file_, header_, layout_, chunk);
        decoder_ = std::make_unique<LazChunkDecoder>(file_, header_, layout_, chunk, layers_);
        for (std::uint64_t before = next_ - decoder_->chunk().first; before > 0;) {
            before -= decode(before).size();
        }
    }

    InputFile file_;
    LasHeader header_;
    std::vector<LasField> fields_;
    LazLayout layout_;
    SourceInfo info_;
    ColumnSelection selection_;
    LasLayers layers_;
    std::array<GridAxis, 3> axes_{GridAxis(header_.scale.x, header_.offset.x),
                                  GridAxis(header_.scale.y, header_.offset.y),
                                  GridAxis(header_.scale.z, header_.offset.z)};
    std::unique_ptr<LazChunkDecoder> decoder_;
    std::vector<LasIndex> block_;
    std::vector<std::byte> records_;  // of the points in block_, if columns are selected
    std::uint64_t next_ = 0;
};

}  // namespace

std::unique_ptr<PointSource> open_laz(InputFile file, const LasHeader& header,
                                      std::span<const LasRecord> records,
                                      std::vector<LasField> fields, SourceInfo info) {
    if (!has_laszip()) {
        throw InputError(fmt::format(
            "{}: expected a file that this knap can read, found {}: it was built without LASzip "
            "(package liblaszip-dev)",
            file.path().string(), info.format));
    }
    LazLayout layout = read_laz_layout(file, header, records);
    return std::make_unique<LazSource>(std::move(file), header, std::move(fields),
                                       std::move(layout), std::move(info));
}

}  // namespace knap

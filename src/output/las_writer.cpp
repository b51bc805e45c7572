#include "output/las_writer.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstring>
#include <optional>
#include <vector>

#include "base/scalar.hpp"
#include "output/las_fields.hpp"
#include "output/las_grid.hpp"
#include "output/las_head.hpp"
#include "output/laz_encoder.hpp"

namespace knap {

namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
constexpr std::size_t kReturns = 14;  // byte of the returns in every point format

/// A value as the type of its field, which holds it.
void store_as(ScalarType to_type, std::byte* to, ScalarType from_type, const std::byte* from) {
    visit_scalar(from_type, [&](auto from_tag) {
        typename decltype(from_tag)::Type value;
        std::memcpy(&value, from, sizeof value);
        // A field holds all values of what goes into it: the sign is kept.
        // NOLINTBEGIN(bugprone-signed-char-misuse)
        visit_scalar(to_type, [&](auto to_tag) {
            const auto stored = static_cast<typename decltype(to_tag)::Type>(value);
            std::memcpy(to, &stored, sizeof stored);
        });
        // NOLINTEND(bugprone-signed-char-misuse)
    });
}

class LasWriter final : public CloudWriter {
  public:
    LasWriter(const std::filesystem::path& path, const CloudHeader& header, bool compressed)
        : CloudWriter(path, header.points, header.attributes),
          attributes_(header.attributes),
          fields_(header),
          axes_{GridSteps(header.coordinates.scale.x, header.coordinates.offset.x),
                GridSteps(header.coordinates.scale.y, header.coordinates.offset.y),
                GridSteps(header.coordinates.scale.z, header.coordinates.offset.z)},
          record_(fields_.record_length()) {
        std::vector<std::byte> laszip;
        if (compressed) {
            encoder_.emplace(file(), path, fields_.point_format(), fields_.record_length());
            laszip = encoder_->record();
        }
        head_.emplace(header, fields_, laszip);
        file().write(head_->before_points(tally_, 0));
        if (encoder_) {
            encoder_->begin();
        }
        buffer_.reserve(kBufferBytes + record_.size());
    }

  protected:
    void put(std::span<const Vec3> positions, std::span<const std::byte> rows) override {
        for (std::size_t i = 0; i < positions.size(); ++i) {
            encode(positions[i], rows.subspan(i * row_bytes(), row_bytes()), i);
            if (encoder_) {
                encoder_->append(record_);
                continue;
            }
            buffer_.insert(buffer_.end(), record_.begin(), record_.end());
            if (buffer_.size() >= kBufferBytes) {
                flush();
            }
        }
    }

    void put_end() override {
        if (encoder_) {
            encoder_->end();
        }
        flush();
        const std::uint64_t extended_at = file().size();
        file().write(head_->extended_records());
        file().write_at(0, head_->before_points(tally_, extended_at));
    }

  private:
    void encode(const Vec3& position, std::span<const std::byte> row, std::size_t point) {
        std::fill(record_.begin(), record_.end(), std::byte{0});
        std::array<std::int32_t, 3> steps{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double coordinate = position[static_cast<int>(axis)];
            const std::optional<std::int32_t> step = axes_[axis].at(coordinate);
            if (!step) {
                fail_at(point, std::string(1, "xyz"[axis]), "a coordinate within 2^31 steps",
                        fmt::format("{}", coordinate));
            }
            steps[axis] = *step;
        }
        std::memcpy(record_.data(), steps.data(), sizeof steps);
        if (fields_.without_returns()) {
            record_[kReturns] = static_cast<std::byte>(1U | (1U << fields_.return_bits()));
        }
        for (std::size_t i = 0; i < attributes_.size(); ++i) {
            const std::size_t size = attributes_[i].value_size();
            put_value(i, row.data(), point);
            row = row.subspan(size);
        }
        const auto returns = std::to_integer<unsigned>(record_[kReturns]);
        tally_.add(steps, returns & ((1U << fields_.return_bits()) - 1));
    }

    void put_value(std::size_t attribute, const std::byte* value, std::size_t point) {
        const Attribute& from = attributes_[attribute];
        const LasFields::Place& place = fields_.places()[attribute];
        if (!place.field) {
            std::memcpy(record_.data() + place.offset, value, from.value_size());
            return;
        }
        const LasRecordField& field = *place.field;
        if (field.width == 0) {
            store_as(field.type, record_.data() + field.offset, from.type, value);
            return;
        }
        const auto bits = std::to_integer<unsigned>(*value);
        if (bits >= (1U << field.width)) {
            fail_at(point, from.name,
                    fmt::format("0 .. {}, as point format {} has it", (1U << field.width) - 1,
                                fields_.point_format()),
                    fmt::format("{}", bits));
        }
        record_[field.offset] |= static_cast<std::byte>(bits << field.shift);
    }

    void flush() {
        file().write(buffer_);
        buffer_.clear();
    }

    std::vector<Attribute> attributes_;
    LasFields fields_;
    std::array<GridSteps, 3> axes_;
    std::vector<std::byte> record_;
    std::vector<std::byte> buffer_;
    LasTally tally_;
    std::optional<LazEncoder> encoder_;
    std::optional<LasHead> head_;
};

}  // namespace

std::unique_ptr<CloudWriter> open_las_writer(const std::filesystem::path& path,
                                             const CloudHeader& header, bool compressed) {
    return std::make_unique<LasWriter>(path, header, compressed);
}

}  // namespace knap

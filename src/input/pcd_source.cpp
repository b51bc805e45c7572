#include "input/pcd_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <string_view>
#include <utility>

#include "input/columns.hpp"
#include "input/coordinates.hpp"
#include "input/pcd_header.hpp"
#include "input/pcd_rows.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr bool kSwap = std::endian::native != std::endian::little;

/// Where a column of the schema lies in a record.
struct Place {
    std::size_t field = 0;
    std::size_t offset = 0;  ///< of its first byte
};

/// The schema of a file and where its columns are.
struct Layout {
    std::vector<Attribute> schema;
    std::vector<Place> places;
    std::array<std::size_t, 3> axes{};
};

/// Is this a colour of four bytes in one value, whatever its type says?
bool is_packed_colour(const PcdField& field) {
    return (field.name == "rgb" || field.name == "rgba") && field.size() == 4 && field.count == 1;
}

/// Normals go by the names that they have in a PLY.
std::string name_of(const PcdField& field) {
    constexpr std::array<std::pair<std::string_view, const char*>, 3> kNormals{
        {{"normal_x", "nx"}, {"normal_y", "ny"}, {"normal_z", "nz"}}};
    for (const auto& [name, known] : kNormals) {
        if (field.name == name) {
            return known;
        }
    }
    return field.name;
}

Layout lay_out(const InputFile& file, const PcdHeader& header) {
    constexpr std::array<std::string_view, 3> kAxes{"x", "y", "z"};
    Layout layout;
    std::array<int, 3> matches{};
    const auto add = [&](std::size_t field, std::size_t offset, Attribute attribute) {
        layout.schema.push_back(std::move(attribute));
        layout.places.push_back({field, header.fields[field].offset + offset});
    };
    for (std::size_t i = 0; i < header.fields.size(); ++i) {
        const PcdField& field = header.fields[i];
        if (field.is_padding()) {
            continue;
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (field.name == kAxes[axis] && field.count == 1) {
                layout.axes[axis] = layout.schema.size();
                ++matches[axis];
            }
        }
        if (is_packed_colour(field)) {
            // Blue is the lowest byte.
            add(i, 2, {"red", ScalarType::kUint8, 1});
            add(i, 1, {"green", ScalarType::kUint8, 1});
            add(i, 0, {"blue", ScalarType::kUint8, 1});
            if (field.name == "rgba") {
                add(i, 3, {"alpha", ScalarType::kUint8, 1});
            }
        } else {
            add(i, 0, {name_of(field), field.type, static_cast<int>(field.count)});
        }
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (matches[axis] != 1) {
            throw InputError(
                fmt::format("{}: expected one field '{}' of one value in the PCD header, found {}",
                            file.path().string(), kAxes[axis], matches[axis]));
        }
    }
    make_names_unique(layout.schema);
    return layout;
}

const char* format_name(PcdEncoding encoding) {
    switch (encoding) {
        case PcdEncoding::kAscii:
            return "PCD (ASCII)";
        case PcdEncoding::kBinary:
            return "PCD (binary)";
        case PcdEncoding::kCompressed:
            break;
    }
    return "PCD (binary, compressed)";
}

SourceInfo describe(const InputFile& file, const PcdHeader& header, const Layout& layout) {
    SourceInfo info;
    info.path = file.path();
    info.format = format_name(header.encoding);
    info.schema = layout.schema;
    info.axes = layout.axes;
    const auto type_of = [&](std::size_t axis) { return info.schema[info.axes[axis]].type; };
    info.coordinates = format_of_coordinates({type_of(0), type_of(1), type_of(2)});
    info.declared_count = header.points;
    info.seek_granularity = header.encoding == PcdEncoding::kBinary ? 1 : 0;
    info.size_bytes = file.size();
    if (header.height > 1) {
        info.unsupported.push_back(
            fmt::format("the order in {} rows of {} points", header.height, header.width));
    }
    if (header.has_viewpoint) {
        info.unsupported.emplace_back("the viewpoint");
    }
    return info;
}

class PcdSource final : public PointSource {
  public:
    PcdSource(InputFile file, PcdHeader header)
        : file_(std::move(file)),
          header_(std::move(header)),
          layout_(lay_out(file_, header_)),
          info_(describe(file_, header_, layout_)),
          rows_(open_pcd_rows(file_, header_)) {
        want_fields();
    }

    const SourceInfo& info() const override { return info_; }

    void select(std::span<const std::size_t> attributes) override {
        selection_.select(info_, attributes);
        want_fields();
    }

    bool read(Chunk& chunk, std::size_t max_points) override;

    void seek(std::uint64_t index) override {
        if (info_.seek_granularity == 0 || index > header_.points) {
            throw InputError(fmt::format("{}: cannot seek to point {} of {}", file_.path().string(),
                                         index, header_.points));
        }
        rows_->seek(index);
        next_ = index;
    }

  private:
    void want_fields() {
        std::vector<bool> wanted(header_.fields.size());
        for (const std::size_t axis : info_.axes) {
            wanted[layout_.places[axis].field] = true;
        }
        for (std::size_t i = 0; i < selection_.size(); ++i) {
            wanted[layout_.places[selection_.attribute(i)].field] = true;
        }
        rows_->want(wanted);
    }

    InputFile file_;
    PcdHeader header_;
    Layout layout_;
    SourceInfo info_;
    std::unique_ptr<PcdRows> rows_;
    ColumnSelection selection_;
    std::uint64_t next_ = 0;
};

bool PcdSource::read(Chunk& chunk, std::size_t max_points) {
    const auto wanted =
        static_cast<std::size_t>(std::min<std::uint64_t>(header_.points - next_, max_points));
    chunk.first = next_;
    chunk.positions.resize(wanted);
    selection_.resize(chunk, wanted);
    if (wanted == 0) {
        rows_->finish();
        return false;
    }
    constexpr std::size_t kBlockBytes = std::size_t{1} << 16;
    const std::size_t block = std::max<std::size_t>(1, kBlockBytes / header_.stride);
    for (std::size_t done = 0; done < wanted;) {
        const std::size_t n = std::min(block, wanted - done);
        const std::byte* rows = rows_->read(n);
        for (int axis = 0; axis < 3; ++axis) {
            const std::size_t column = info_.axes[static_cast<std::size_t>(axis)];
            decode_coordinate(rows + layout_.places[column].offset, header_.stride, n,
                              chunk.positions.data() + done, axis, info_.schema[column].type,
                              kSwap);
        }
        for (std::size_t i = 0; i < selection_.size(); ++i) {
            copy_values(rows + layout_.places[selection_.attribute(i)].offset, header_.stride, n,
                        selection_.at(chunk, i, done), selection_.value_size(i), kSwap);
        }
        done += n;
    }
    next_ += wanted;
    return true;
}

}  // namespace

std::unique_ptr<PointSource> open_pcd(InputFile file) {
    PcdHeader header = read_pcd_header(file);
    return std::make_unique<PcdSource>(std::move(file), std::move(header));
}

}  // namespace knap

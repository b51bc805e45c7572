#include "input/ply_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "input/columns.hpp"
#include "input/coordinates.hpp"
#include "input/gzip.hpp"
#include "input/ply_ascii_source.hpp"
#include "input/ply_binary_source.hpp"
#include "input/ply_header.hpp"

namespace knap {

namespace {

const char* format_name(PlyEncoding encoding) {
    switch (encoding) {
        case PlyEncoding::kAscii:
            return "PLY (ASCII)";
        case PlyEncoding::kLittleEndian:
            return "PLY (binary little-endian)";
        case PlyEncoding::kBigEndian:
            break;
    }
    return "PLY (binary big-endian)";
}

bool can_seek(const PlyHeader& header) {
    const auto first = header.elements.begin();
    return header.encoding != PlyEncoding::kAscii &&
           std::all_of(first, first + static_cast<std::ptrdiff_t>(header.vertex) + 1,
                       [](const PlyElement& e) { return e.count == 0 || e.fixed_size(); });
}

/// A column for each property that is no list; lists may differ in length from point to point.
void describe_properties(const PlyHeader& header, SourceInfo& info) {
    const std::vector<PlyProperty>& properties = header.vertices().properties;
    for (std::size_t i = 0; i < properties.size(); ++i) {
        if (properties[i].list_count) {
            info.unsupported.push_back(fmt::format("list property '{}'", properties[i].name));
            continue;
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (header.axes[axis] == i) {
                info.axes[axis] = info.schema.size();
            }
        }
        info.schema.push_back({properties[i].name, properties[i].type, 1});
    }
    make_names_unique(info.schema);
    for (std::size_t i = 0; i < header.elements.size(); ++i) {
        const PlyElement& element = header.elements[i];
        if (i != header.vertex && element.count > 0) {
            info.unsupported.push_back(fmt::format("element '{}'", element.name));
        }
    }
}

SourceInfo describe(const InputFile& file, const PlyHeader& header) {
    SourceInfo info;
    info.path = file.path();
    info.format =
        fmt::format("{}{}", format_name(header.encoding), is_gunzipped(file) ? ", gzip" : "");
    describe_properties(header, info);
    const auto type_of = [&](std::size_t axis) { return info.schema[info.axes[axis]].type; };
    info.coordinates = format_of_coordinates({type_of(0), type_of(1), type_of(2)});
    info.declared_count = header.vertices().count;
    info.seek_granularity = can_seek(header) && file.size_known() ? 1 : 0;
    info.size_bytes = file.size_on_disk();
    return info;
}

}  // namespace

std::unique_ptr<PointSource> open_ply(InputFile file) {
    PlyHeader header = read_ply_header(file);
    SourceInfo info = describe(file, header);
    return header.encoding == PlyEncoding::kAscii
               ? open_ascii_ply(std::move(file), std::move(header), std::move(info))
               : open_binary_ply(std::move(file), std::move(header), std::move(info));
}

}  // namespace knap

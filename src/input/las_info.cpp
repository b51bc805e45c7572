#include "input/las_info.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace knap {

namespace {

CoordinateFormat coordinate_format(const LasHeader& header) {
    // A mirrored axis is read, but cannot be said in the form that kInt32 promises.
    if (header.scale.x < 0 || header.scale.y < 0 || header.scale.z < 0) {
        return {};
    }
    return {CoordinateKind::kInt32, header.scale, header.offset};
}

}  // namespace

SourceInfo describe_las(const InputFile& file, const LasHeader& header,
                        std::span<const LasRecord> records) {
    SourceInfo info;
    info.path = file.path();
    const bool is_copc = std::ranges::any_of(
        records, [](const LasRecord& r) { return r.user_id == "copc" && r.id == 1; });
    info.format = fmt::format("{} 1.{}, point format {}{}", header.compressed ? "LAZ" : "LAS",
                              header.version_minor, header.point_format, is_copc ? " (COPC)" : "");
    info.schema = las_schema(file, header, records);
    info.coordinates = coordinate_format(header);
    info.declared_count = header.count;
    info.crs = las_crs(file, records);
    info.size_bytes = file.size();
    return info;
}

}  // namespace knap

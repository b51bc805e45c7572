#include "emit/cloud_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

#include "output/las_grid.hpp"

namespace knap {

namespace {

constexpr const char* kProjection = "LASF_Projection";
constexpr int kNewestMinor = 4;

bool is_las(CloudFormat format) {
    return format == CloudFormat::kLas || format == CloudFormat::kLaz;
}

bool same_key(const LasVlr& a, const LasVlr& b) {
    return a.user_id == b.user_id && a.record_id == b.record_id;
}

/// The records that tell the coordinate system.
std::vector<LasVlr> projection_of(const LasHeaderInfo& info) {
    std::vector<LasVlr> records;
    std::copy_if(info.records.begin(), info.records.end(), std::back_inserter(records),
                 [](const LasVlr& record) { return record.user_id == kProjection; });
    return records;
}

/// Sets a field to what it is in all sources, or to `otherwise`.
template <typename T>
void agree(LasHeaderInfo& common, const LasHeaderInfo& other, T LasHeaderInfo::*field,
           const T& otherwise) {
    if (common.*field != other.*field) {
        common.*field = otherwise;
    }
}

/// Puts the LAS headers of several sources into one.
class LasMerge {
  public:
    explicit LasMerge(std::vector<std::string>& notes) : notes_(notes) {}

    void add(const CloudOrigin& origin) {
        if (!origin.las) {
            return;
        }
        if (!common_) {
            common_ = origin.las;
            first_ = origin.path;
            return;
        }
        add_header(*origin.las, origin.path);
        add_records(*origin.las, origin.path);
    }

    std::optional<LasHeaderInfo> take() {
        if (differing_records_ > 0) {
            notes_.push_back(fmt::format(
                "{} records of the sources' headers are there with other content, and are not "
                "written; the first is of {}",
                differing_records_, first_differing_));
        }
        return std::move(common_);
    }

  private:
    void add_header(const LasHeaderInfo& other, const std::string& path) {
        constexpr std::uint16_t kTimeType = 1;
        LasHeaderInfo& common = *common_;
        if (((common.global_encoding ^ other.global_encoding) & kTimeType) != 0 && !told_time_) {
            notes_.push_back(
                fmt::format("{} and {} count GPS time in different ways; the header "
                            "says what the first does",
                            first_, path));
            told_time_ = true;
        }
        agree(common, other, &LasHeaderInfo::version_minor, kNewestMinor);
        common.point_format = std::max(common.point_format, other.point_format);
        agree(common, other, &LasHeaderInfo::file_source_id, std::uint16_t{0});
        agree(common, other, &LasHeaderInfo::project_id, {});
        agree(common, other, &LasHeaderInfo::system_identifier, std::string("MERGE"));
        if (common.creation_year != other.creation_year ||
            common.creation_day != other.creation_day) {
            common.creation_year = 0;
            common.creation_day = 0;
        }
    }

    void add_records(const LasHeaderInfo& other, const std::string& path) {
        const std::size_t before = common_->records.size();
        for (const LasVlr& record : other.records) {
            if (record.user_id == kProjection) {
                continue;
            }
            const auto begin = common_->records.begin();
            const auto end = begin + static_cast<std::ptrdiff_t>(before);
            if (std::find(begin, end, record) != end) {
                continue;
            }
            if (std::any_of(begin, end, [&](const LasVlr& r) { return same_key(r, record); })) {
                first_differing_ = differing_records_ == 0 ? path : first_differing_;
                ++differing_records_;
            } else {
                common_->records.push_back(record);
            }
        }
        // Extended records are the last ones.
        std::stable_sort(
            common_->records.begin(), common_->records.end(),
            [](const LasVlr& a, const LasVlr& b) { return !a.extended && b.extended; });
    }

    std::vector<std::string>& notes_;
    std::optional<LasHeaderInfo> common_;
    std::string first_;
    std::string first_differing_;
    std::size_t differing_records_ = 0;
    bool told_time_ = false;
};

/// Do two sources that say where they are say the same? Records are compared where they name no
/// system that knap knows.
bool same_crs(const CloudOrigin& a, const CloudOrigin& b) {
    if (!a.crs.empty() || !b.crs.empty()) {
        return a.crs == b.crs;
    }
    return projection_of(*a.las) == projection_of(*b.las);
}

/// True if all sources that say where they are say the same.
bool same_crs(std::span<const CloudOrigin> origins) {
    const auto says = [](const CloudOrigin& origin) {
        return !origin.crs.empty() || (origin.las && !projection_of(*origin.las).empty());
    };
    const auto first = std::find_if(origins.begin(), origins.end(), says);
    return std::all_of(origins.begin(), origins.end(), [&](const CloudOrigin& origin) {
        return !says(origin) || same_crs(*first, origin);
    });
}

CoordinateFormat coordinates_of(CloudFormat format, std::span<const CloudOrigin> origins,
                                const CloudContent& content, std::vector<std::string>& notes) {
    if (is_las(format)) {
        std::vector<CoordinateFormat> formats;
        formats.reserve(origins.size());
        for (const CloudOrigin& origin : origins) {
            formats.push_back(origin.coordinates);
        }
        const LasGrid grid = choose_las_grid(formats, content.box, content.step);
        if (!grid.exact) {
            const Vec3& scale = grid.format.scale;
            notes.push_back(
                fmt::format("the sources have no common grid: LAS has steps of {} here, and "
                            "positions move by half of it at most",
                            std::max({scale.x, scale.y, scale.z})));
        }
        return grid.format;
    }
    const bool floats = std::all_of(origins.begin(), origins.end(), [](const CloudOrigin& origin) {
        return origin.coordinates.kind == CoordinateKind::kFloat32;
    });
    CoordinateFormat coordinates;
    coordinates.kind =
        floats && content.as_stored ? CoordinateKind::kFloat32 : CoordinateKind::kFloat64;
    return coordinates;
}

}  // namespace

HeaderWithNotes make_cloud_header(CloudFormat format, std::span<const CloudOrigin> origins,
                                  const CloudContent& content) {
    HeaderWithNotes result;
    CloudHeader& header = result.header;
    header.points = content.points;
    header.attributes = content.attributes;
    header.coordinates = coordinates_of(format, origins, content, result.notes);
    const bool agreed = same_crs(origins);
    for (const CloudOrigin& origin : origins) {
        header.crs = header.crs.empty() && agreed ? origin.crs : header.crs;
    }
    if (!agreed) {
        result.notes.emplace_back(
            "the sources have different coordinate systems: the output names none");
    }
    if (is_las(format)) {
        LasMerge merge(result.notes);
        for (const CloudOrigin& origin : origins) {
            merge.add(origin);
        }
        header.las = merge.take();
        if (header.las && !agreed) {
            std::erase_if(header.las->records,
                          [](const LasVlr& record) { return record.user_id == kProjection; });
        }
    }
    const std::vector<std::string> of_format = notes_on(format, header);
    result.notes.insert(result.notes.end(), of_format.begin(), of_format.end());
    return result;
}

}  // namespace knap

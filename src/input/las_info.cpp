#include "input/las_info.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <initializer_list>

#include "input/bytes.hpp"
#include "input/number.hpp"

namespace knap {

namespace {

// Offsets in the public header block.
constexpr std::size_t kSourceId = 4, kProjectId = 8, kSystem = 26, kSoftware = 58, kDay = 90,
                      kYear = 92, kHeadSize = 94, kTextSize = 32;

/// Most bytes of records that are carried along: they are held for every open file.
constexpr std::uint64_t kMostRecordBytes = std::uint64_t{16} << 20;

CoordinateFormat coordinate_format(const LasHeader& header) {
    // A mirrored axis is read, but cannot be said in the form that kInt32 promises.
    if (header.scale.x < 0 || header.scale.y < 0 || header.scale.z < 0) {
        return {};
    }
    return {CoordinateKind::kInt32, header.scale, header.offset};
}

bool is_waveform(const LasRecord& record) {
    constexpr std::uint16_t kFirstDescriptor = 100, kLastDescriptor = 354, kPackets = 65535;
    return record.user_id == "LASF_Spec" &&
           ((record.id >= kFirstDescriptor && record.id <= kLastDescriptor) ||
            record.id == kPackets);
}

/// Does a record describe how this very file is stored? Then it means nothing in another.
bool is_of_this_file(const LasRecord& record) {
    constexpr std::uint16_t kExtraBytes = 4, kSpatialIndex = 30;
    return record.user_id == "laszip encoded" || record.user_id == "copc" ||
           (record.user_id == "LASF_Spec" && record.id == kExtraBytes) ||
           (record.user_id == "LAStools" && record.id == kSpatialIndex);
}

void take_records(const InputFile& file, std::span<const LasRecord> records, SourceInfo& info,
                  std::vector<LasVlr>& taken) {
    std::uint64_t bytes = 0;
    for (const LasRecord& record : records) {
        if (is_of_this_file(record) || is_waveform(record)) {
            continue;
        }
        if (bytes + record.length > kMostRecordBytes) {
            info.unsupported.push_back(fmt::format(
                "record {} {} of {} bytes", excerpt(record.user_id), record.id, record.length));
            continue;
        }
        bytes += record.length;
        taken.push_back(
            {.user_id = record.user_id,
             .record_id = record.id,
             .description = record.description,
             .extended = record.extended,
             .content = read_las_record(file, record, static_cast<std::size_t>(record.length))});
    }
}

LasHeaderInfo header_info(const InputFile& file, const LasHeader& header) {
    std::array<std::byte, kHeadSize> head{};
    file.read_some(0, head);
    const auto text = [&](std::size_t at) {
        const char* begin = reinterpret_cast<const char*>(head.data() + at);
        return std::string(begin, ::strnlen(begin, kTextSize));
    };
    LasHeaderInfo info;
    info.version_minor = header.version_minor;
    info.point_format = header.point_format;
    info.file_source_id = load_little<std::uint16_t>(head.data() + kSourceId);
    info.global_encoding = header.global_encoding;
    std::copy_n(head.begin() + kProjectId, info.project_id.size(), info.project_id.begin());
    info.system_identifier = text(kSystem);
    info.generating_software = text(kSoftware);
    info.creation_day = load_little<std::uint16_t>(head.data() + kDay);
    info.creation_year = load_little<std::uint16_t>(head.data() + kYear);
    return info;
}

}  // namespace

SourceInfo describe_las(const InputFile& file, const LasHeader& header,
                        std::span<const LasRecord> records, std::span<const LasField> fields) {
    SourceInfo info;
    info.path = file.path();
    const bool is_copc = std::ranges::any_of(
        records, [](const LasRecord& r) { return r.user_id == "copc" && r.id == 1; });
    info.format = fmt::format("{} 1.{}, point format {}{}", header.compressed ? "LAZ" : "LAS",
                              header.version_minor, header.point_format, is_copc ? " (COPC)" : "");
    info.schema.reserve(fields.size());
    for (const LasField& field : fields) {
        info.schema.push_back(field.attribute);
    }
    make_names_unique(info.schema);
    info.coordinates = coordinate_format(header);
    info.declared_count = header.count;
    info.crs = las_crs(file, records);
    info.size_bytes = file.size();
    for (const int with_waveforms : {4, 5, 9, 10}) {
        if (header.point_format == with_waveforms) {
            info.unsupported.emplace_back("waveform packets");
        }
    }
    info.las = header_info(file, header);
    take_records(file, records, info, info.las->records);
    return info;
}

}  // namespace knap

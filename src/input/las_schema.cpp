#include <array>
#include <cstring>
#include <initializer_list>
#include <string>

#include "base/scalar.hpp"
#include "input/bytes.hpp"
#include "input/las_info.hpp"

namespace knap {

namespace {

using enum ScalarType;

struct Field {
    const char* name;
    ScalarType type;
};

// Bit fields are listed one by one, as the smallest type that holds them.
constexpr std::array kHead{Field{"X", kInt32},
                           Field{"Y", kInt32},
                           Field{"Z", kInt32},
                           Field{"Intensity", kUint16},
                           Field{"ReturnNumber", kUint8},
                           Field{"NumberOfReturns", kUint8}};
constexpr std::array kLegacyFlags{
    Field{"ScanDirectionFlag", kUint8}, Field{"EdgeOfFlightLine", kUint8},
    Field{"Classification", kUint8},    Field{"Synthetic", kUint8},
    Field{"KeyPoint", kUint8},          Field{"Withheld", kUint8},
    Field{"ScanAngleRank", kInt8},      Field{"UserData", kUint8},
    Field{"PointSourceId", kUint16}};
constexpr std::array kFlags{Field{"ClassFlags", kUint8},        Field{"ScanChannel", kUint8},
                            Field{"ScanDirectionFlag", kUint8}, Field{"EdgeOfFlightLine", kUint8},
                            Field{"Classification", kUint8},    Field{"UserData", kUint8},
                            Field{"ScanAngle", kInt16},         Field{"PointSourceId", kUint16}};
constexpr std::array kGpsTime{Field{"GpsTime", kFloat64}};
constexpr std::array kColour{Field{"Red", kUint16}, Field{"Green", kUint16},
                             Field{"Blue", kUint16}};
constexpr std::array kInfrared{Field{"Infrared", kUint16}};
constexpr std::array kWaveform{
    Field{"WaveformDescriptor", kUint8}, Field{"WaveformOffset", kUint64},
    Field{"WaveformSize", kUint32},      Field{"WaveformLocation", kFloat32},
    Field{"WaveformXt", kFloat32},       Field{"WaveformYt", kFloat32},
    Field{"WaveformZt", kFloat32}};

void append(std::vector<Attribute>& schema, std::span<const Field> fields) {
    for (const Field& field : fields) {
        schema.push_back({field.name, field.type, 1});
    }
}

constexpr bool has(std::initializer_list<int> formats, int format) {
    for (const int candidate : formats) {
        if (candidate == format) {
            return true;
        }
    }
    return false;
}

/// One descriptor of the "extra bytes" record.
Attribute read_descriptor(std::span<const std::byte> descriptor) {
    constexpr std::size_t kType = 2, kOptions = 3, kName = 4, kNameSize = 32;
    constexpr std::array kTypes{kUint8, kInt8,   kUint16, kInt16,   kUint32,
                                kInt32, kUint64, kInt64,  kFloat32, kFloat64};
    const auto type = std::to_integer<std::size_t>(descriptor[kType]);
    const char* name = reinterpret_cast<const char*>(descriptor.data() + kName);
    Attribute attribute{.name = std::string(name, ::strnlen(name, kNameSize))};
    if (type == 0 || type > 3 * kTypes.size()) {
        attribute.type = kUint8;
        attribute.components = std::to_integer<int>(descriptor[kOptions]);
    } else {
        attribute.type = kTypes[(type - 1) % kTypes.size()];
        attribute.components = static_cast<int>((type - 1) / kTypes.size()) + 1;
    }
    return attribute;
}

/// Names what lies behind the fields of the point format; bytes that no record describes are one
/// attribute of their own.
void append_extra_bytes(std::vector<Attribute>& schema, const InputFile& file, std::size_t extra,
                        std::span<const LasRecord> records) {
    constexpr std::uint16_t kExtraBytesRecord = 4;
    constexpr std::size_t kDescriptor = 192;
    for (const LasRecord& record : records) {
        if (record.user_id != "LASF_Spec" || record.id != kExtraBytesRecord) {
            continue;
        }
        const std::vector<std::byte> content = read_las_record(file, record, std::size_t{1} << 20);
        for (std::size_t at = 0; at + kDescriptor <= content.size(); at += kDescriptor) {
            const Attribute attribute =
                read_descriptor(std::span(content).subspan(at, kDescriptor));
            const std::size_t bytes =
                size_of(attribute.type) * static_cast<std::size_t>(attribute.components);
            if (bytes == 0 || bytes > extra) {
                continue;
            }
            schema.push_back(attribute);
            extra -= bytes;
        }
    }
    if (extra > 0) {
        schema.push_back({"ExtraBytes", kUint8, static_cast<int>(extra)});
    }
}

}  // namespace

std::vector<Attribute> las_schema(const InputFile& file, const LasHeader& header,
                                  std::span<const LasRecord> records) {
    const int format = header.point_format;
    std::vector<Attribute> schema;
    append(schema, kHead);
    if (format <= 5) {
        append(schema, kLegacyFlags);
    } else {
        append(schema, kFlags);
    }
    if (format >= 6 || has({1, 3, 4, 5}, format)) {
        append(schema, kGpsTime);
    }
    if (has({2, 3, 5, 7, 8, 10}, format)) {
        append(schema, kColour);
    }
    if (has({8, 10}, format)) {
        append(schema, kInfrared);
    }
    if (has({4, 5, 9, 10}, format)) {
        append(schema, kWaveform);
    }
    append_extra_bytes(schema, file, header.record_length - las_record_length(format), records);
    return schema;
}

}  // namespace knap

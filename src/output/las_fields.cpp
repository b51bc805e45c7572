#include "output/las_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <set>
#include <string_view>

#include "base/bytes.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

using enum ScalarType;

constexpr LasRecordField bits(const char* name, std::size_t offset, unsigned shift,
                              unsigned width) {
    return {name, kUint8, offset, shift, width};
}

constexpr std::array kLegacy{LasRecordField{"intensity", kUint16, 12},
                             bits("return_number", 14, 0, 3),
                             bits("number_of_returns", 14, 3, 3),
                             bits("scan_direction", 14, 6, 1),
                             bits("edge_of_flight_line", 14, 7, 1),
                             bits("classification", 15, 0, 5),
                             bits("synthetic", 15, 5, 1),
                             bits("key_point", 15, 6, 1),
                             bits("withheld", 15, 7, 1),
                             LasRecordField{"scan_angle_rank", kInt8, 16},
                             LasRecordField{"user_data", kUint8, 17},
                             LasRecordField{"point_source_id", kUint16, 18}};
constexpr std::array kExtended{LasRecordField{"intensity", kUint16, 12},
                               bits("return_number", 14, 0, 4),
                               bits("number_of_returns", 14, 4, 4),
                               bits("synthetic", 15, 0, 1),
                               bits("key_point", 15, 1, 1),
                               bits("withheld", 15, 2, 1),
                               bits("overlap", 15, 3, 1),
                               bits("scanner_channel", 15, 4, 2),
                               bits("scan_direction", 15, 6, 1),
                               bits("edge_of_flight_line", 15, 7, 1),
                               LasRecordField{"classification", kUint8, 16},
                               LasRecordField{"user_data", kUint8, 17},
                               LasRecordField{"scan_angle", kInt16, 18},
                               LasRecordField{"point_source_id", kUint16, 20},
                               LasRecordField{"gps_time", kFloat64, 22}};
constexpr std::array<const char*, 3> kColours{"red", "green", "blue"};

// Of the formats 0 to 8; those that are not written have 0.
constexpr std::array<std::uint16_t, 9> kRecordLengths{20, 28, 26, 34, 0, 0, 30, 36, 38};

constexpr std::string_view kScanAngle = "scan_angle";
constexpr double kScanAngleScale = 0.006;
constexpr std::size_t kLongestRecord = 65535;
constexpr std::size_t kNameBytes = 32;

std::vector<LasRecordField> fields_of(int format) {
    std::vector<LasRecordField> fields;
    if (format >= 6) {
        fields.assign(kExtended.begin(), kExtended.end());
    } else {
        fields.assign(kLegacy.begin(), kLegacy.end());
    }
    if (format == 1 || format == 3) {
        fields.push_back({"gps_time", kFloat64, 20});
    }
    if (format == 2 || format == 3 || format >= 7) {
        std::size_t at = format == 2 ? 20 : format == 3 ? 28 : 30;
        for (const char* colour : kColours) {
            fields.push_back({colour, kUint16, at});
            at += sizeof(std::uint16_t);
        }
    }
    if (format == 8) {
        fields.push_back({"near_infrared", kUint16, 36});
    }
    return fields;
}

/// Does the field hold every value of the type? Bits are looked at value by value.
bool holds(ScalarType field, ScalarType type) {
    return field == type || (field == kUint16 && type == kUint8) ||
           (field == kInt16 && (type == kInt8 || type == kUint8)) ||
           (field == kFloat64 && type == kFloat32);
}

bool suits(const LasRecordField& field, const Attribute& attribute) {
    const bool plain = attribute.scale == 1 ||
                       (attribute.name == kScanAngle && attribute.scale == kScanAngleScale);
    return attribute.name == field.name && attribute.components == 1 && plain &&
           attribute.offset == 0 && holds(field.type, attribute.type);
}

const LasRecordField* find_field(std::span<const LasRecordField> fields,
                                 const Attribute& attribute) {
    const auto found = std::find_if(fields.begin(), fields.end(), [&](const LasRecordField& field) {
        return suits(field, attribute);
    });
    return found == fields.end() ? nullptr : &*found;
}

bool has_field(std::span<const Attribute> attributes, std::string_view name) {
    const std::vector<LasRecordField> fields = fields_of(name == "gps_time" ? 3 : 8);
    return std::any_of(attributes.begin(), attributes.end(), [&](const Attribute& attribute) {
        return attribute.name == name && find_field(fields, attribute) != nullptr;
    });
}

/// Extra bytes may have two or three values of one kind, or undescribed bytes in any number.
bool fits_descriptor(const Attribute& attribute) {
    return attribute.components <= 3 || (attribute.type == kUint8 && attribute.components <= 255);
}

/// The names of extra bytes: at most 32 bytes, each another one.
class ExtraNames {
  public:
    std::string next(const std::string& name) {
        std::string result = name.substr(0, kNameBytes);
        for (int n = 2; !taken_.insert(result).second; ++n) {
            const std::string tail = fmt::format("_{}", n);
            result = name.substr(0, kNameBytes - tail.size()) + tail;
        }
        return result;
    }

  private:
    std::set<std::string> taken_;
};

void store_text(std::span<std::byte> to, const std::string& text) {
    std::memcpy(to.data(), text.data(), std::min(to.size(), text.size()));
}

/// @param first  of the components that it describes
void append_descriptor(std::vector<std::byte>& record, const std::string& name,
                       const Attribute& attribute, std::size_t first, int components) {
    constexpr std::size_t kSize = 192, kType = 2, kOptions = 3, kName = 4, kMissing = 40,
                          kLeast = 64, kGreatest = 88, kScale = 112, kOffset = 136,
                          kDescription = 160;
    constexpr std::array kTypes{kUint8, kInt8,   kUint16, kInt16,   kUint32,
                                kInt32, kUint64, kInt64,  kFloat32, kFloat64};
    constexpr std::uint8_t kHasMissing = 1, kHasLeast = 1 << 1, kHasGreatest = 1 << 2,
                           kHasScale = 1 << 3, kHasOffset = 1 << 4;
    const std::size_t at = record.size();
    record.resize(at + kSize);
    const std::span<std::byte> to = std::span(record).subspan(at);
    const auto place = std::find(kTypes.begin(), kTypes.end(), attribute.type) - kTypes.begin();
    if (components > 3) {
        to[kOptions] = static_cast<std::byte>(components);
    } else {
        to[kType] = static_cast<std::byte>(
            place + 1 + static_cast<std::ptrdiff_t>(kTypes.size()) * (components - 1));
        std::uint8_t options = attribute.scale != 1 ? kHasScale : 0;
        options |= attribute.offset != 0 ? kHasOffset : 0;
        const auto store = [&](const std::vector<std::uint64_t>& values, std::size_t place_of,
                               std::uint8_t option) {
            if (values.size() >= first + static_cast<std::size_t>(components)) {
                options |= option;
                std::memcpy(&to[place_of], &values[first],
                            static_cast<std::size_t>(components) * sizeof(std::uint64_t));
            }
        };
        store(attribute.limits.missing, kMissing, kHasMissing);
        store(attribute.limits.least, kLeast, kHasLeast);
        store(attribute.limits.greatest, kGreatest, kHasGreatest);
        to[kOptions] = static_cast<std::byte>(options);
        for (std::size_t i = 0; i < static_cast<std::size_t>(components); ++i) {
            if ((options & kHasScale) != 0) {
                std::memcpy(&to[kScale + 8 * i], &attribute.scale, sizeof(double));
            }
            if ((options & kHasOffset) != 0) {
                std::memcpy(&to[kOffset + 8 * i], &attribute.offset, sizeof(double));
            }
        }
    }
    store_text(to.subspan(kName, kNameBytes), name);
    store_text(to.subspan(kDescription, 32), attribute.description);
}

}  // namespace

LasFields::LasFields(const CloudHeader& header) : attributes_(header.attributes) {
    choose_format(header);
    place_all();
    tell(header);
}

void LasFields::choose_format(const CloudHeader& header) {
    const bool extended = !header.las || header.las->point_format >= 6;
    const bool colours = std::all_of(kColours.begin(), kColours.end(), [&](const char* name) {
        return has_field(attributes_, name);
    });
    const bool infrared = colours && has_field(attributes_, "near_infrared");
    if (extended) {
        point_format_ = infrared ? 8 : colours ? 7 : 6;
    } else {
        point_format_ = (has_field(attributes_, "gps_time") ? 1 : 0) + (colours ? 2 : 0);
    }
    // LAS 1.0 had other rules for what its header says; 1.1 has no colours.
    const int source_version = header.las ? std::clamp(header.las->version_minor, 1, 4) : 4;
    version_minor_ = extended ? 4 : std::max(source_version, colours ? 2 : 1);
    const bool wants_extended_records =
        header.las && std::any_of(header.las->records.begin(), header.las->records.end(),
                                  [](const LasVlr& record) { return record.extended; });
    if (wants_extended_records || header.points > 0xffffffffU) {
        version_minor_ = 4;
    }
}

void LasFields::place_all() {
    const std::vector<LasRecordField> fields = fields_of(point_format_);
    std::size_t length = kRecordLengths.at(static_cast<std::size_t>(point_format_));
    without_returns_ = true;
    for (const Attribute& attribute : attributes_) {
        if (const LasRecordField* field = find_field(fields, attribute)) {
            places_.push_back({*field, 0});
            without_returns_ = without_returns_ &&
                               field->name != std::string_view("return_number") &&
                               field->name != std::string_view("number_of_returns");
        } else {
            places_.push_back({std::nullopt, length});
            length += attribute.value_size();
        }
    }
    if (length > kLongestRecord) {
        throw ConfigError(fmt::format(
            "output.attributes (--attributes): expected at most {} bytes a point for LAS, found {}",
            kLongestRecord, length));
    }
    record_length_ = static_cast<std::uint16_t>(length);
}

std::vector<std::byte> LasFields::extra_bytes_record() const {
    std::vector<std::byte> record;
    ExtraNames names;
    for (std::size_t i = 0; i < attributes_.size(); ++i) {
        const Attribute& attribute = attributes_[i];
        if (places_[i].field) {
            continue;
        }
        if (fits_descriptor(attribute)) {
            append_descriptor(record, names.next(attribute.name), attribute, 0,
                              attribute.components);
            continue;
        }
        for (int component = 0; component < attribute.components; ++component) {
            append_descriptor(record, names.next(fmt::format("{}_{}", attribute.name, component)),
                              attribute, static_cast<std::size_t>(component), 1);
        }
    }
    return record;
}

void LasFields::tell(const CloudHeader& header) {
    if (header.las) {
        const int format = header.las->point_format;
        if (format == 4 || format == 5 || format >= 9) {
            notes_.push_back(fmt::format("point format {} becomes {}: waveforms are not written",
                                         format, point_format_));
        }
        if (header.las->version_minor > 4) {
            notes_.push_back(
                fmt::format("LAS 1.{} becomes 1.4: a time offset in the header is not "
                            "written",
                            header.las->version_minor));
        }
    }
    for (std::size_t i = 0; i < attributes_.size(); ++i) {
        if (!places_[i].field && attributes_[i].name.size() > kNameBytes) {
            notes_.push_back(fmt::format("LAS has names of at most {} bytes: that of {} is cut",
                                         kNameBytes, attributes_[i].name));
        }
    }
}

}  // namespace knap

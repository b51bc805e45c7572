#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "base/scalar.hpp"
#include "input/bytes.hpp"
#include "input/las_info.hpp"

namespace knap {

namespace {

using enum ScalarType;

constexpr std::uint16_t kExtraBytesRecord = 4;
constexpr std::size_t kDescriptor = 192;
constexpr std::size_t kMostBytes = std::size_t{1} << 20;

// Offsets in a descriptor.
constexpr std::size_t kType = 2, kOptions = 3, kName = 4, kMissing = 40, kLeast = 64,
                      kGreatest = 88, kScale = 112, kOffset = 136, kDescription = 160,
                      kTextSize = 32;
constexpr unsigned kHasMissing = 1, kHasLeast = 2, kHasGreatest = 4, kHasScale = 8, kHasOffset = 16;

/// One descriptor of the "extra bytes" record.
class Descriptor {
  public:
    explicit Descriptor(std::span<const std::byte> bytes) : bytes_(bytes) {}

    /// The columns that it describes: one, unless it is an array whose items have scales of their
    /// own. None if it describes no bytes.
    std::vector<Attribute> attributes() const;

  private:
    std::string text(std::size_t at) const {
        const char* begin = reinterpret_cast<const char*>(bytes_.data() + at);
        return {begin, ::strnlen(begin, kTextSize)};
    }
    /// A number of component `i` that is there only if the options say so.
    double number(std::size_t at, std::size_t i, unsigned option, double otherwise) const {
        if ((std::to_integer<unsigned>(bytes_[kOptions]) & option) == 0) {
            return otherwise;
        }
        const auto value = load_little<double>(bytes_.data() + at + i * sizeof(double));
        return std::isfinite(value) ? value : otherwise;
    }

    /// A value of component `i`; empty unless the options say that there is one. Of what is no
    /// number there is one kind.
    std::vector<std::uint64_t> limit(std::size_t at, std::size_t i, unsigned option,
                                     ScalarType type) const {
        if ((std::to_integer<unsigned>(bytes_[kOptions]) & option) == 0) {
            return {};
        }
        const auto bits = load_little<std::uint64_t>(bytes_.data() + at + i * sizeof(double));
        const bool no_number = is_floating(type) && std::isnan(std::bit_cast<double>(bits));
        return {no_number ? std::bit_cast<std::uint64_t>(std::numeric_limits<double>::quiet_NaN())
                          : bits};
    }

    std::span<const std::byte> bytes_;
};

/// Puts the limits of components into one list each.
void append_limits(ValueLimits& all, const ValueLimits& more) {
    const auto append = [](std::vector<std::uint64_t>& to, const std::vector<std::uint64_t>& from) {
        to.insert(to.end(), from.begin(), from.end());
    };
    append(all.missing, more.missing);
    append(all.least, more.least);
    append(all.greatest, more.greatest);
}

std::vector<Attribute> Descriptor::attributes() const {
    constexpr std::array kTypes{kUint8, kInt8,   kUint16, kInt16,   kUint32,
                                kInt32, kUint64, kInt64,  kFloat32, kFloat64};
    Attribute attribute{.name = text(kName), .description = text(kDescription)};
    if (attribute.name.empty()) {
        attribute.name = "extra_bytes";
    }
    const auto type = std::to_integer<std::size_t>(bytes_[kType]);
    if (type == 0 || type > 3 * kTypes.size()) {
        attribute.type = kUint8;
        attribute.components = std::to_integer<int>(bytes_[kOptions]);
        return attribute.components == 0 ? std::vector<Attribute>() : std::vector{attribute};
    }
    attribute.type = kTypes[(type - 1) % kTypes.size()];
    const std::size_t components = (type - 1) / kTypes.size() + 1;
    std::vector<Attribute> parts(components, attribute);
    for (std::size_t i = 0; i < components; ++i) {
        parts[i].scale = number(kScale, i, kHasScale, 1);
        parts[i].offset = number(kOffset, i, kHasOffset, 0);
    }
    const bool alike =
        std::ranges::all_of(parts, [&](const Attribute& part) { return part == parts[0]; });
    for (std::size_t i = 0; i < components; ++i) {
        append_limits(parts[alike ? 0 : i].limits,
                      {limit(kMissing, i, kHasMissing, attribute.type),
                       limit(kLeast, i, kHasLeast, attribute.type),
                       limit(kGreatest, i, kHasGreatest, attribute.type)});
    }
    if (alike) {
        parts[0].components = static_cast<int>(components);
        parts.resize(1);
        return parts;
    }
    for (std::size_t i = 0; i < components; ++i) {
        parts[i].name += fmt::format("[{}]", i);
    }
    return parts;
}

}  // namespace

std::vector<Attribute> las_extra_bytes(const InputFile& file, std::size_t bytes,
                                       std::span<const LasRecord> records) {
    std::vector<Attribute> all;
    for (const LasRecord& record : records) {
        if (record.user_id != "LASF_Spec" || record.id != kExtraBytesRecord) {
            continue;
        }
        const std::vector<std::byte> content = read_las_record(file, record, kMostBytes);
        for (std::size_t at = 0; at + kDescriptor <= content.size(); at += kDescriptor) {
            for (Attribute& attribute :
                 Descriptor(std::span(content).subspan(at, kDescriptor)).attributes()) {
                if (attribute.value_size() > bytes) {
                    // Beyond the record: where the next would lie is anyone's guess.
                    at = content.size();
                    break;
                }
                bytes -= attribute.value_size();
                all.push_back(std::move(attribute));
            }
        }
    }
    if (bytes > 0) {
        all.push_back(
            {.name = "extra_bytes", .type = kUint8, .components = static_cast<int>(bytes)});
    }
    return all;
}

}  // namespace knap

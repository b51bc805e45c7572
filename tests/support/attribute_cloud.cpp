#include "support/attribute_cloud.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "base/scalar.hpp"
#include "support/clouds.hpp"

namespace knap::test {

namespace {

constexpr std::array<std::pair<ScalarType, std::string_view>, 8> kPlyTypes{
    {{ScalarType::kInt8, "char"},
     {ScalarType::kUint8, "uchar"},
     {ScalarType::kInt16, "short"},
     {ScalarType::kUint16, "ushort"},
     {ScalarType::kInt32, "int"},
     {ScalarType::kUint32, "uint"},
     {ScalarType::kFloat32, "float"},
     {ScalarType::kFloat64, "double"}}};

std::string_view ply_type(ScalarType type) {
    for (const auto& [known, name] : kPlyTypes) {
        if (known == type) {
            return name;
        }
    }
    throw std::logic_error("no PLY type");
}

template <typename T>
void append(std::string& text, T value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string on_lattice(const Lattice& lattice, const Vec3& position) {
    std::string text;
    for (int axis = 0; axis < 3; ++axis) {
        append(text, std::llround((position[axis] - lattice.origin[axis]) / lattice.step));
    }
    return text;
}

/// The bytes of a value as another type, by way of long double, which holds all of either.
std::string as_type(ScalarType to, ScalarType from, const std::byte* bytes, int components) {
    if (to == from) {
        return {reinterpret_cast<const char*>(bytes),
                size_of(from) * static_cast<std::size_t>(components)};
    }
    std::string text;
    for (int i = 0; i < components; ++i) {
        visit_scalar(from, [&](auto from_tag) {
            typename decltype(from_tag)::Type value{};
            std::memcpy(&value, bytes + static_cast<std::size_t>(i) * sizeof value, sizeof value);
            visit_scalar(to, [&](auto to_tag) {
                using To = typename decltype(to_tag)::Type;
                append(text, static_cast<To>(static_cast<long double>(value)));
            });
        });
    }
    return text;
}

}  // namespace

std::vector<std::byte> random_column(std::mt19937_64& random, const Attribute& attribute,
                                     std::size_t points, bool small) {
    std::vector<std::byte> column(points * attribute.value_size());
    visit_scalar(attribute.type, [&](auto tag) {
        using T = typename decltype(tag)::Type;
        for (std::size_t at = 0; at < column.size(); at += sizeof(T)) {
            const std::uint64_t bits = random();
            const T value = static_cast<T>(bits % 10);
            std::memcpy(column.data() + at, small ? static_cast<const void*>(&value) : &bits,
                        sizeof value);
        }
    });
    return column;
}

AttributeCloud attribute_cloud(std::size_t points, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    AttributeCloud cloud;
    cloud.positions = sphere_cloud(points, seed);
    for (const char* name : {"red", "green", "blue"}) {
        cloud.attributes.push_back({name, ScalarType::kUint8});
    }
    for (const char* name : {"nx", "ny", "nz"}) {
        cloud.attributes.push_back({name, ScalarType::kFloat32});
    }
    for (const auto& [type, name] : kPlyTypes) {
        cloud.attributes.push_back({"any_" + std::string(name), type});
        cloud.attributes.push_back({"small_" + std::string(name), type});
    }
    for (const Attribute& attribute : cloud.attributes) {
        cloud.columns.push_back(
            random_column(random, attribute, points, attribute.name.starts_with("small")));
    }
    return cloud;
}

void write_ply(const std::filesystem::path& path, const AttributeCloud& cloud, bool as_float) {
    std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                        std::to_string(cloud.positions.size()) + "\n";
    for (const char* axis : {"x", "y", "z"}) {
        bytes += std::string("property ") + (as_float ? "float " : "double ") + axis + "\n";
    }
    for (const Attribute& attribute : cloud.attributes) {
        bytes += "property " + std::string(ply_type(attribute.type)) + " " + attribute.name + "\n";
    }
    bytes += "end_header\n";
    for (std::size_t i = 0; i < cloud.positions.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            if (as_float) {
                append(bytes, static_cast<float>(cloud.positions[i][axis]));
            } else {
                append(bytes, cloud.positions[i][axis]);
            }
        }
        for (std::size_t k = 0; k < cloud.attributes.size(); ++k) {
            const std::size_t size = cloud.attributes[k].value_size();
            bytes.append(reinterpret_cast<const char*>(cloud.columns[k].data()) + i * size, size);
        }
    }
    std::ofstream(path, std::ios::binary) << bytes;
}

std::vector<std::string> carried_by_sources(const std::vector<std::filesystem::path>& files,
                                            const std::vector<PointId>& ids,
                                            const Manifest& manifest) {
    std::vector<std::string> result;
    PointId first = 0;
    auto next = ids.begin();
    for (const std::filesystem::path& file : files) {
        const std::unique_ptr<PointSource> source = open_source(file);
        const std::vector<std::size_t> selected = attributes_of(source->info());
        source->select(selected);
        for (Chunk chunk; source->read(chunk, 10000);) {
            for (std::size_t i = 0; i < chunk.positions.size(); ++i, ++first) {
                if (next == ids.end() || *next != first) {
                    continue;
                }
                ++next;
                std::string text = on_lattice(manifest.lattice, chunk.positions[i]);
                for (const Attribute& wanted : manifest.attributes) {
                    std::string value(wanted.value_size(), '\0');
                    for (std::size_t k = 0; k < selected.size(); ++k) {
                        const Attribute& there = source->info().schema[selected[k]];
                        if (there.name == wanted.name) {
                            value = as_type(wanted.type, there.type,
                                            chunk.columns[k].data() + i * there.value_size(),
                                            there.components);
                        }
                    }
                    text += value;
                }
                result.push_back(std::move(text));
            }
        }
    }
    std::sort(result.begin(), result.end());
    return result;
}

std::vector<std::string> carried_by(const Archive& archive) {
    const Manifest& manifest = archive.manifest();
    std::vector<std::string> result;
    for (std::size_t number = 0; number < manifest.tiles.size(); ++number) {
        const Tile tile = archive.read_whole_tile(number);
        for (std::size_t i = 0; i < tile.positions.size(); ++i) {
            std::string text = on_lattice(manifest.lattice, tile.positions[i]);
            for (std::size_t k = 0; k < manifest.attributes.size(); ++k) {
                const std::size_t size = manifest.attributes[k].value_size();
                text.append(reinterpret_cast<const char*>(tile.columns[k].data()) + i * size, size);
            }
            result.push_back(std::move(text));
        }
    }
    std::sort(result.begin(), result.end());
    return result;
}

}  // namespace knap::test

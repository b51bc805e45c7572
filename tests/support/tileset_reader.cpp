#include "support/tileset_reader.hpp"

#include <draco/attributes/attribute_quantization_transform.h>
#include <draco/compression/decode.h>
#include <draco/core/decoder_buffer.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <stdexcept>

namespace knap::test {

namespace {

using Json = nlohmann::json;
using Matrix = std::array<double, 16>;

constexpr const char* kExtension = "3DTILES_draco_point_compression";

std::string read_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        throw std::runtime_error(path.string() + ": missing");
    }
    return {std::istreambuf_iterator<char>(file), {}};
}

Matrix product(const Matrix& a, const Matrix& b) {
    Matrix result{};
    for (std::size_t column = 0; column < 4; ++column) {
        for (std::size_t row = 0; row < 4; ++row) {
            for (std::size_t k = 0; k < 4; ++k) {
                result[4 * column + row] += a[4 * k + row] * b[4 * column + k];
            }
        }
    }
    return result;
}

Vec3 apply(const Matrix& m, const Vec3& p) {
    return {m[0] * p.x + m[4] * p.y + m[8] * p.z + m[12],
            m[1] * p.x + m[5] * p.y + m[9] * p.z + m[13],
            m[2] * p.x + m[6] * p.y + m[10] * p.z + m[14]};
}

double determinant(const Vec3& a, const Vec3& b, const Vec3& c) {
    return a.x * (b.y * c.z - b.z * c.y) - b.x * (a.y * c.z - a.z * c.y) +
           c.x * (a.y * b.z - a.z * b.y);
}

/// Coordinates of which `m` makes a place, by Cramer's rule.
Vec3 undo(const Matrix& m, const Vec3& place) {
    const Vec3 x{m[0], m[1], m[2]};
    const Vec3 y{m[4], m[5], m[6]};
    const Vec3 z{m[8], m[9], m[10]};
    const Vec3 p = place - Vec3{m[12], m[13], m[14]};
    const double d = determinant(x, y, z);
    return {determinant(p, y, z) / d, determinant(x, p, z) / d, determinant(x, y, p) / d};
}

/// A tile on the way from the root.
struct Level {
    Matrix matrix{};
    std::vector<double> box;
    std::string name;
};

class Reader {
  public:
    Reader(const std::filesystem::path& folder, const std::string& property)
        : folder_(folder), property_(property) {}

    ReadTileset read() {
        found_.json = Json::parse(read_file(folder_ / "tileset.json"));
        require(found_.json["asset"]["version"] == "1.0", "tileset.json: version");
        tile(found_.json["root"], found_.json["geometricError"], "root", {});
        return std::move(found_);
    }

  private:
    void require(bool holds, const std::string& what) {
        if (!holds && found_.faults.size() < 20) {
            found_.faults.push_back(what);
        }
    }

    void tile(const Json& json, double error_above, const std::string& name,
              std::vector<Level> levels) {
        const double error = json["geometricError"];
        require(name == "root" ? error <= error_above : error < error_above,
                name + ": error not below that of the parent");
        require(json["refine"] == "ADD", name + ": refine");
        Matrix matrix{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
        if (json.contains("transform")) {
            matrix = json["transform"].get<Matrix>();
        }
        if (!levels.empty()) {
            matrix = product(levels.back().matrix, matrix);
        }
        levels.push_back({matrix, json["boundingVolume"]["box"].get<std::vector<double>>(), name});
        if (json.contains("content")) {
            content(json["content"], levels);
        }
        int number = 0;
        for (const Json& child : json.value("children", Json::array())) {
            tile(child, error, name + "/" + std::to_string(number++), levels);
        }
    }

    void content(const Json& json, const std::vector<Level>& levels) {
        const std::string uri = json["uri"];
        const std::string bytes = read_file(folder_ / uri);
        std::array<std::uint32_t, 7> head{};
        std::memcpy(head.data(), bytes.data(), sizeof head);
        require(bytes.substr(0, 4) == "pnts" && head[1] == 1 && head[2] == bytes.size() &&
                    28 + head[3] + head[4] + head[5] + head[6] == bytes.size(),
                uri + ": header");
        require((28 + head[3]) % 8 == 0 && head[4] % 8 == 0 && head[5] % 8 == 0 && head[6] % 8 == 0,
                uri + ": sections are not aligned");
        const Json features = Json::parse(bytes.substr(28, head[3]));
        const Json batch = head[5] == 0
                               ? Json::object()
                               : Json::parse(bytes.substr(28 + head[3] + head[4], head[5]));
        const Json& draco = features["extensions"][kExtension];
        const std::size_t binary = 28 + head[3];
        const std::size_t batch_binary = binary + head[4] + head[5];
        draco::DecoderBuffer buffer;
        buffer.Init(bytes.data() + binary + draco["byteOffset"].get<std::size_t>(),
                    draco["byteLength"].get<std::size_t>());
        draco::Decoder decoder;
        const auto cloud = decoder.DecodePointCloudFromBuffer(&buffer).value();
        const std::size_t n = features["POINTS_LENGTH"];
        require(n == cloud->num_points() && json["extras"]["points"] == n && n > 0,
                uri + ": POINTS_LENGTH");
        note_properties(batch);
        count_floats(bytes.data() + binary, draco["byteLength"], n, uri);

        const Json ids = draco["properties"];
        const auto* positions = cloud->GetAttributeByUniqueId(ids["POSITION"]);
        require(positions->attribute_type() == draco::GeometryAttribute::POSITION,
                uri + ": POSITION");
        const auto* colors =
            ids.contains("RGB") ? cloud->GetAttributeByUniqueId(ids["RGB"]) : nullptr;
        for (std::uint32_t i = 0; i < n; ++i) {
            std::array<float, 3> local{};
            positions->GetMappedValue(draco::PointIndex(i), local.data());
            TilesetPoint point;
            point.place = apply(levels.back().matrix, {local[0], local[1], local[2]});
            if (colors != nullptr) {
                colors->GetMappedValue(draco::PointIndex(i), point.rgb.data());
            }
            if (!property_.empty()) {
                point.value = value(*cloud, batch, bytes.data() + batch_binary, i);
            }
            for (const Level& level : levels) {
                check_box(level, point.place, uri);
            }
            found_.points.push_back(point);
        }
        ++found_.files;
    }

    void note_properties(const Json& batch) {
        if (found_.files == 0) {
            for (const auto& [name, property] : batch.items()) {
                if (name != "extensions") {
                    found_.properties.push_back(name);
                }
            }
        }
    }

    /// As a viewer takes them that does not undo the quantisation: at most 16 bits.
    void count_floats(const char* bytes, std::size_t size, std::size_t points,
                      const std::string& uri) {
        draco::DecoderBuffer buffer;
        buffer.Init(bytes, size);
        draco::Decoder decoder;
        decoder.SetSkipAttributeTransform(draco::GeometryAttribute::POSITION);
        const auto cloud = decoder.DecodePointCloudFromBuffer(&buffer).value();
        const auto* positions = cloud->GetNamedAttribute(draco::GeometryAttribute::POSITION);
        draco::AttributeQuantizationTransform transform;
        if (!transform.InitFromAttribute(*positions)) {
            found_.floats += points;
        } else {
            require(transform.quantization_bits() <= 16, uri + ": more than 16 bits");
        }
    }

    double value(const draco::PointCloud& cloud, const Json& batch, const char* binary,
                 std::uint32_t point) {
        const Json& property = batch[property_];
        const Json compressed =
            batch.contains("extensions") ? batch["extensions"][kExtension]["properties"] : Json();
        if (compressed.contains(property_)) {
            double result = 0;
            const auto* attribute = cloud.GetAttributeByUniqueId(compressed[property_]);
            attribute->ConvertValue(attribute->mapped_index(draco::PointIndex(point)), 1, &result);
            return result;
        }
        const char* const at = binary + property["byteOffset"].get<std::size_t>();
        if (property["componentType"] == "DOUBLE") {
            double result = 0;
            std::memcpy(&result, at + sizeof(double) * point, sizeof result);
            return result;
        }
        require(property["componentType"] == "UNSIGNED_INT", "componentType");
        std::uint32_t result = 0;
        std::memcpy(&result, at + sizeof result * point, sizeof result);
        return result;
    }

    void check_box(const Level& level, const Vec3& place, const std::string& uri) {
        const Vec3 p = undo(level.matrix, place);
        for (int axis = 0; axis < 3; ++axis) {
            const double half = level.box[static_cast<std::size_t>(3 + 4 * axis)];
            const double off = std::abs(p[axis] - level.box[static_cast<std::size_t>(axis)]);
            require(off <= half, uri + ": a point outside of the box of " + level.name);
        }
    }

    std::filesystem::path folder_;
    std::string property_;
    ReadTileset found_;
};

}  // namespace

ReadTileset read_tileset(const std::filesystem::path& folder, const std::string& property) {
    return Reader(folder, property).read();
}

}  // namespace knap::test

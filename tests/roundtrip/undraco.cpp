// Writes what a Draco file holds as it is, by Draco's own decoder: what the round-trip test reads
// tiles with. undraco IN.drc OUT ...
//
// OUT has lines of words, then a line "end", then the values of each attribute, point by point:
//   points <number>
//   attribute <kind> <type> <components>
//   text <entry> <hex>     of the attribute before it; of the cloud before the first
//   number <entry> <value>

#include <draco/attributes/point_attribute.h>
#include <draco/compression/decode.h>
#include <draco/core/decoder_buffer.h>
#include <draco/metadata/geometry_metadata.h>
#include <draco/point_cloud/point_cloud.h>

#include <fstream>
#include <iomanip>
#include <iostream>
#include <iterator>
#include <memory>
#include <span>
#include <sstream>
#include <string>
#include <vector>

namespace {

std::string hex(const std::string& text) {
    std::ostringstream out;
    for (const char c : text) {
        out << std::hex << std::setw(2) << std::setfill('0')
            << static_cast<int>(static_cast<unsigned char>(c));
    }
    return out.str();
}

/// An entry has no type: one of 8 bytes may be a number or a text.
void describe(const draco::Metadata* metadata, std::ostream& out) {
    if (metadata == nullptr) {
        return;
    }
    for (const auto& [name, value] : metadata->entries()) {
        std::string text;
        double number = 0;
        metadata->GetEntryString(name, &text);
        out << "text " << name << ' ' << hex(text) << '\n';
        if (metadata->GetEntryDouble(name, &number)) {
            out << "number " << name << ' ' << std::setprecision(17) << number << '\n';
        }
    }
}

void write(const draco::PointCloud& cloud, std::ostream& out) {
    out << "points " << cloud.num_points() << '\n';
    describe(cloud.GetMetadata(), out);
    for (int i = 0; i < cloud.num_attributes(); ++i) {
        const draco::PointAttribute& attribute = *cloud.attribute(i);
        out << "attribute " << static_cast<int>(attribute.attribute_type()) << ' '
            << static_cast<int>(attribute.data_type()) << ' '
            << static_cast<int>(attribute.num_components()) << '\n';
        describe(cloud.GetAttributeMetadataByAttributeId(i), out);
    }
    out << "end\n";
    for (int i = 0; i < cloud.num_attributes(); ++i) {
        const draco::PointAttribute& attribute = *cloud.attribute(i);
        std::vector<char> value(static_cast<std::size_t>(attribute.byte_stride()));
        for (draco::PointIndex point(0); point < cloud.num_points(); ++point) {
            attribute.GetMappedValue(point, value.data());
            out.write(value.data(), static_cast<std::streamsize>(value.size()));
        }
    }
}

int convert(const char* from, const char* to) {
    std::ifstream in(from, std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data(), bytes.size());
    draco::Decoder decoder;
    const auto cloud = decoder.DecodePointCloudFromBuffer(&buffer);
    if (!cloud.ok()) {
        std::cerr << "undraco: " << from << ": " << cloud.status().error_msg_string() << '\n';
        return 1;
    }
    std::ofstream out(to, std::ios::binary);
    write(*cloud.value(), out);
    return out.good() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
    const std::span<char*> arguments(argv, static_cast<std::size_t>(argc));
    if (arguments.size() % 2 == 0) {
        std::cerr << "usage: undraco IN.drc OUT ...\n";
        return 1;
    }
    for (std::size_t i = 1; i < arguments.size(); i += 2) {
        if (convert(arguments[i], arguments[i + 1]) != 0) {
            return 1;
        }
    }
    return 0;
}

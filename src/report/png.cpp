#include <fmt/format.h>
#include <png.h>

#include "knap/error.hpp"
#include "report/image.hpp"

namespace knap {

std::vector<std::byte> encode_png(const Image& image) {
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = static_cast<png_uint_32>(image.width);
    png.height = static_cast<png_uint_32>(image.height);
    png.format = PNG_FORMAT_RGB;
    // Asked for the size, libpng does all the work; its upper bound is cheap.
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
    std::vector<std::byte> bytes(size);
    if (png_image_write_to_memory(&png, bytes.data(), &size, 0, image.pixels.data(), 0, nullptr) ==
        0) {
        throw StorageError(fmt::format("picture: cannot encode it as PNG: {}", png.message));
    }
    bytes.resize(size);
    return bytes;
}

}  // namespace knap

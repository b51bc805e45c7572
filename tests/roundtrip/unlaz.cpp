// Writes the points of a LAZ file as a LAS file, by LASzip's own interface: what the round-trip
// test reads compressed files with. unlaz IN.laz OUT.las

#include <laszip/laszip_api.h>

#include <cstdint>
#include <iostream>
#include <span>

namespace {

int fail(laszip_POINTER zip, const char* what) {
    laszip_CHAR* error = nullptr;
    laszip_get_error(zip, &error);
    std::cerr << "unlaz: " << what << ": " << (error != nullptr ? error : "") << '\n';
    return 1;
}

}  // namespace

int main(int argc, char** argv) {
    const std::span<char*> arguments(argv, static_cast<std::size_t>(argc));
    if (arguments.size() != 3) {
        std::cerr << "usage: unlaz IN OUT\n";
        return 1;
    }
    laszip_POINTER reader = nullptr;
    laszip_POINTER writer = nullptr;
    laszip_BOOL compressed = 0;
    laszip_create(&reader);
    laszip_create(&writer);
    if (laszip_open_reader(reader, arguments[1], &compressed) != 0) {
        return fail(reader, arguments[1]);
    }
    laszip_header_struct* header = nullptr;
    laszip_point_struct* point = nullptr;
    laszip_get_header_pointer(reader, &header);
    laszip_get_point_pointer(reader, &point);
    const std::uint64_t points = header->number_of_point_records != 0
                                     ? header->number_of_point_records
                                     : header->extended_number_of_point_records;
    if (laszip_set_header(writer, header) != 0 || laszip_request_native_extension(writer, 1) != 0 ||
        laszip_open_writer(writer, arguments[2], compressed == 0 ? 1 : 0) != 0) {
        return fail(writer, arguments[2]);
    }
    for (std::uint64_t i = 0; i < points; ++i) {
        if (laszip_read_point(reader) != 0) {
            return fail(reader, arguments[1]);
        }
        if (laszip_set_point(writer, point) != 0 || laszip_write_point(writer) != 0) {
            return fail(writer, arguments[2]);
        }
    }
    laszip_close_writer(writer);
    laszip_close_reader(reader);
    laszip_destroy(writer);
    laszip_destroy(reader);
    return 0;
}

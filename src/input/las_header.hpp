#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "knap/geometry.hpp"

namespace knap {

/// What knap uses of the public header block of a LAS or LAZ file. The box is left out: it is often
/// wrong and never needed.
struct LasHeader {
    int version_minor = 0;  ///< of LAS 1.n
    std::uint16_t global_encoding = 0;
    std::uint16_t header_size = 0;
    std::uint32_t points_offset = 0;
    std::uint32_t vlr_count = 0;
    int point_format = 0;  ///< 0 to 10
    bool compressed = false;
    std::uint16_t record_length = 0;
    std::uint64_t count = 0;
    Vec3 scale;
    Vec3 offset;
    std::uint64_t waveform_start = 0;  ///< LAS 1.3 on; 0: none
    std::uint64_t evlr_start = 0;      ///< LAS 1.4 on
    std::uint32_t evlr_count = 0;      ///< LAS 1.4 on
};

/// Bytes of a point of format `point_format` without extra bytes.
std::uint16_t las_record_length(int point_format);

/// Reads and checks the header.
/// @throws InputError if the file cannot hold it or a field is out of its range
LasHeader read_las_header(const InputFile& file);

/// A variable-length record, extended or not.
struct LasRecord {
    std::string user_id;
    std::uint16_t id = 0;
    std::string description;
    bool extended = false;
    std::uint64_t offset = 0;  ///< of its content
    std::uint64_t length = 0;
};

/// The variable-length records of a file, the extended ones last. Records that do not fit where the
/// header puts them end the list: nothing that places points depends on them.
std::vector<LasRecord> list_las_records(const InputFile& file, const LasHeader& header);

/// The content of a record, at most `most` bytes of it.
std::vector<std::byte> read_las_record(const InputFile& file, const LasRecord& record,
                                       std::size_t most);

}  // namespace knap

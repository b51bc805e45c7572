#pragma once

#include <optional>
#include <string>

#include "base/file.hpp"

namespace knap {

enum class FileFormat { kPly, kLas, kPcd, kDraco, kArchive, kPtx, kText };

/// What a file is, told by its first bytes and then by its ending.
struct Recognition {
    std::optional<FileFormat> format;  ///< empty if knap does not read it
    bool gzipped = false;              ///< PLY and text: it is what a gzip file decodes to
    bool certain = false;  ///< meant as a point cloud, not a text that may be about anything
    std::string found;     ///< without a format: what it is instead, for an error message
};

Recognition recognise(const InputFile& file);

}  // namespace knap

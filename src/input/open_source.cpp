#include <fmt/format.h>

#include <system_error>
#include <utility>

#include "base/file.hpp"
#include "input/archive_source.hpp"
#include "input/draco_source.hpp"
#include "input/gzip.hpp"
#include "input/las_source.hpp"
#include "input/pcd_source.hpp"
#include "input/ply_source.hpp"
#include "input/ptx_source.hpp"
#include "input/recognise.hpp"
#include "input/text_source.hpp"
#include "knap/error.hpp"
#include "knap/source.hpp"
#include "store/manifest.hpp"

namespace knap {

namespace {

std::unique_ptr<PointSource> open_as(FileFormat format, InputFile file) {
    switch (format) {
        case FileFormat::kPly:
            return open_ply(std::move(file));
        case FileFormat::kLas:
            return open_las(std::move(file));
        case FileFormat::kPcd:
            return open_pcd(std::move(file));
        case FileFormat::kDraco:
            return open_draco(file);
        case FileFormat::kArchive:
            return open_archive(file);
        case FileFormat::kPtx:
            return open_ptx(std::move(file));
        case FileFormat::kText:
            break;
    }
    return open_text(std::move(file));
}

}  // namespace

std::unique_ptr<PointSource> open_source(const std::filesystem::path& path) {
    const std::filesystem::path manifest = path / kManifestName;
    std::error_code ignored;
    InputFile file(std::filesystem::exists(manifest, ignored) ? manifest : path);
    if (file.size() == 0) {
        throw InputError(
            fmt::format("{}: expected a point cloud, found an empty file", path.string()));
    }
    const Recognition recognition = recognise(file);
    if (!recognition.format) {
        throw InputError(
            fmt::format("{}: expected PLY, LAS, LAZ, PCD, Draco, a knap archive or text with x, y "
                        "and z, found {}",
                        path.string(), recognition.found));
    }
    return open_as(*recognition.format,
                   recognition.gzipped ? gunzip(std::move(file)) : std::move(file));
}

}  // namespace knap

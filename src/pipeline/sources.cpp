#include "pipeline/sources.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <string>

#include "knap/source.hpp"

namespace knap {

namespace fs = std::filesystem;

std::vector<fs::path> find_sources(const Job& job, Progress& progress) {
    std::vector<std::string> patterns = job.input;
    if (!job.standard_input.empty()) {
        std::replace(patterns.begin(), patterns.end(), std::string(kStandardInput),
                     job.standard_input.string());
    }
    std::vector<fs::path> left_out;
    std::vector<fs::path> files = expand_sources(patterns, &left_out);
    if (!left_out.empty()) {
        progress.note(
            fmt::format("{} files of the input folders are no point clouds that knap reads, "
                        "and are left out; the first is {}",
                        left_out.size(), left_out.front().string()));
    }
    return files;
}

std::vector<SourceInfo> source_infos(const std::vector<fs::path>& files) {
    std::vector<SourceInfo> infos;
    infos.reserve(files.size());
    for (const fs::path& file : files) {
        infos.push_back(open_source(file)->info());
    }
    return infos;
}

void tell_what_stays_behind(const SourceTable& table, Progress& progress) {
    std::set<std::string> names;
    for (const SourceEntry& source : table.sources()) {
        for (const Attribute& attribute : source.info.schema) {
            if (attribute.name.find_first_not_of("xyzXYZ") != std::string::npos) {
                names.insert(attribute.name);
            }
        }
    }
    if (!names.empty()) {
        progress.note(fmt::format("only positions are written; {} attributes stay behind: {}",
                                  names.size(), fmt::join(names, ", ")));
    }
}

}  // namespace knap

#include "pipeline/identity.hpp"

#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <span>
#include <string_view>
#include <system_error>

#include "base/checksum.hpp"
#include "emit/emit.hpp"
#include "emit/output_check.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::int64_t modified(const fs::path& file) {
    std::error_code error;
    const fs::file_time_type time = fs::last_write_time(file, error);
    return error ? 0 : std::chrono::nanoseconds(time.time_since_epoch()).count();
}

std::uint64_t size_of(const fs::path& file) {
    std::error_code error;
    const std::uint64_t size = fs::file_size(file, error);
    return error ? 0 : size;
}

}  // namespace

Json identity_of(const Job& job, const std::vector<fs::path>& files) {
    Json identity{
        {"knap", KNAP_VERSION}, {"parameters", Json::object()}, {"sources", Json::array()}};
    for (const auto& [key, value] : result_parameters(job)) {
        identity["parameters"][key] = value;
    }
    for (const fs::path& file : files) {
        identity["sources"].push_back(
            {{"path", file.string()}, {"bytes", size_of(file)}, {"modified", modified(file)}});
    }
    return identity;
}

std::string difference(const Json& before, const Json& now,
                       const std::function<bool(std::size_t)>& same_content) {
    if (before.at("knap") != now.at("knap")) {
        return fmt::format("knap was {}, is {}", before.at("knap").get<std::string>(),
                           now.at("knap").get<std::string>());
    }
    for (const auto& [key, value] : now.at("parameters").items()) {
        const std::string was = before.at("parameters").value(key, "not there");
        if (was != value.get<std::string>()) {
            return fmt::format("{} was {}, is {}", key, was, value.get<std::string>());
        }
    }
    const Json& sources_before = before.at("sources");
    const Json& sources = now.at("sources");
    if (sources_before.size() != sources.size()) {
        return fmt::format("there were {} input files, there are {}", sources_before.size(),
                           sources.size());
    }
    for (std::size_t i = 0; i < sources.size(); ++i) {
        const std::string path = sources[i].at("path");
        if (sources_before[i].at("path") != path) {
            return fmt::format("input file {} was {}, is {}", i + 1,
                               sources_before[i].at("path").get<std::string>(), path);
        }
        if (sources_before[i].at("bytes") != sources[i].at("bytes")) {
            return fmt::format("{} had {} bytes, has {}", path,
                               sources_before[i].at("bytes").get<std::uint64_t>(),
                               sources[i].at("bytes").get<std::uint64_t>());
        }
        if (sources_before[i].at("modified") != sources[i].at("modified") && !same_content(i)) {
            return fmt::format("{} was written again and holds something else", path);
        }
    }
    return "";
}

std::string scratch_name(const Job& job) {
    const fs::path output = output_path(job.output.path);
    const std::string whole = fs::weakly_canonical(fs::absolute(output)).string();
    const std::uint64_t hash = xxh3_64(std::as_bytes(std::span(whole.data(), whole.size())));
    return fmt::format("knap-{}-{:08x}", output.filename().string(), hash & 0xffffffffU);
}

}  // namespace knap

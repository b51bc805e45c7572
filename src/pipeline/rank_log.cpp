#include "pipeline/rank_log.hpp"

#include <string>

namespace knap {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kSpacing = "spacing";
constexpr const char* kRank = "rank";
constexpr const char* kStragglers = "stragglers";

// JSON keeps doubles and whole numbers to the bit.
Json to_json(const ExactSum& sum) {
    return sum.limbs();
}

ExactSum sum_from(const Json& json) {
    return ExactSum::from_limbs(json.get<ExactSum::Limbs>());
}

// Files are recorded by name: the scratch folder may be moved.
std::string name_of(const fs::path& path) {
    return path.filename().string();
}

fs::path path_of(const fs::path& folder, const Json& name) {
    const auto text = name.get<std::string>();
    return text.empty() ? fs::path() : folder / text;
}

}  // namespace

RankState read_rank_state(const JobLog& log, const fs::path& folder, std::size_t bricks) {
    RankState state;
    if (const Json* spacing = log.find(kSpacing)) {
        state.spacing = spacing->at("spacing").get<double>();
    }
    state.bricks.resize(bricks);
    for (std::size_t i = 0; i < bricks; ++i) {
        if (const Json* json = log.find(kRank, number_name(i))) {
            BrickRank brick;
            brick.run = path_of(folder, json->at("run"));
            brick.straggler_run = path_of(folder, json->at("straggler_run"));
            brick.points = json->at("points");
            brick.stragglers = json->at("stragglers");
            brick.merged = json->at("merged");
            brick.curvature_sum = sum_from(json->at("curvature_sum"));
            state.bricks[i] = std::move(brick);
        }
    }
    if (const Json* json = log.find(kStragglers)) {
        SettledStragglers settled;
        for (const Json& run : json->at("runs")) {
            settled.runs.push_back(
                {run.at("brick"), path_of(folder, run.at("run")), run.at("points")});
        }
        settled.curvature_sum = sum_from(json->at("curvature_sum"));
        state.stragglers = std::move(settled);
    }
    return state;
}

void record_spacing(JobLog& log, double spacing) {
    log.record(kSpacing, "", {{"spacing", spacing}});
}

void record_brick(JobLog& log, std::size_t brick, const BrickRank& ranked) {
    log.record(kRank, number_name(brick),
               {{"run", name_of(ranked.run)},
                {"straggler_run", name_of(ranked.straggler_run)},
                {"points", ranked.points},
                {"stragglers", ranked.stragglers},
                {"merged", ranked.merged},
                {"curvature_sum", to_json(ranked.curvature_sum)}});
}

void record_stragglers(JobLog& log, const SettledStragglers& settled) {
    Json runs = Json::array();
    for (const SettledStragglers::Run& run : settled.runs) {
        runs.push_back({{"brick", run.brick}, {"run", name_of(run.path)}, {"points", run.points}});
    }
    log.record(kStragglers, "",
               {{"runs", runs}, {"curvature_sum", to_json(settled.curvature_sum)}});
}

}  // namespace knap

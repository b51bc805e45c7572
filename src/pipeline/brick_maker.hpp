#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "knap/params.hpp"
#include "rank/gather.hpp"
#include "store/brick_file.hpp"
#include "store/brick_plan.hpp"
#include "store/ranked_run.hpp"
#include "store/source_table.hpp"

namespace knap {

/// Makes once more what was lost of a brick, from the sources: one brick at a time, by a pass over
/// all of them. Thread-safe.
class BrickMaker {
  public:
    /// What is told, in one line, why and that a brick is made again.
    using Note = std::function<void(const std::string&)>;

    /// @param folder  of the brick files
    /// @param frames  of the points too
    /// All references must outlive the object.
    BrickMaker(const SourceTable& table, const BrickPlan& plan,
               const std::vector<BrickFile>& bricks, std::filesystem::path folder,
               const CurvatureParams& curvature, bool frames, int threads, Note note);

    /// The brick file.
    void scatter(std::size_t brick, const std::string& why);

    /// The brick's ranked points; its file is removed again.
    /// @param spacing  of the archive, cloud units
    std::vector<RankedPoint> rank(std::size_t brick, double spacing, const std::string& why);

  private:
    void scatter_one(std::size_t brick, const std::string& why) const;
    CoreAccess sources() const;

    const SourceTable& table_;
    const BrickPlan& plan_;
    const std::vector<BrickFile>& bricks_;
    std::filesystem::path folder_;
    const CurvatureParams& curvature_;
    bool frames_;
    int threads_;
    Note note_;
    std::mutex mutex_;
};

}  // namespace knap

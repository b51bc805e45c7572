#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "knap/geometry.hpp"
#include "store/ranked_run.hpp"
#include "store/selection.hpp"

namespace knap {

/// How far a repair has come.
struct RepairState {
    int attempt = 0;              ///< begun anew so often, as its files were damaged
    int pass = 0;                 ///< with a lower limit each
    int round = 0;                ///< of the pass
    double limit = 0;             ///< of the pass, cloud units; 0: not found yet
    std::uint64_t kept = 0;       ///< in the selection
    std::uint64_t violators = 0;  ///< that the last round found
    bool done = false;            ///< nothing is farther than the tolerance
    Selection selection;
};

/// The parts of an archive, and runs of some of their points that are put away under a kind.
class RepairStore {
  public:
    enum Kind {
        kKept,      ///< so far; a copy of what `points` and the selection say
        kSuspects,  ///< farther from the surface than the limit when a round begins
        kOpen       ///< what merge leaves open
    };

    virtual ~RepairStore() = default;
    virtual std::size_t parts() const = 0;
    /// Of the points of a part.
    virtual Box box(std::size_t part) const = 0;
    virtual std::uint64_t points(std::size_t part) const = 0;

    /// Those of a part's counted points that are wanted, in any order. Thread-safe, as all below.
    virtual std::vector<RankedPoint> read(
        std::size_t part, const std::function<bool(const RankedPoint&)>& wanted) = 0;

    /// Puts points away, in the method's order, instead of what was there.
    virtual void put(std::size_t part, Kind kind, std::vector<RankedPoint> points) = 0;
    /// What was put away.
    /// @throws StorageError if it is damaged
    virtual std::unique_ptr<RankedStream> stream(std::size_t part, Kind kind) = 0;

    /// The selection that repair began with.
    virtual Selection base() = 0;
    /// Names what is done, so that an interrupted job goes on from it.
    virtual void save(const RepairState& state) = 0;
    virtual std::optional<RepairState> saved() = 0;
    virtual void save_suspects(std::size_t part, const RepairState& state) = 0;
    virtual bool has_suspects(std::size_t part, const RepairState& state) = 0;
};

}  // namespace knap

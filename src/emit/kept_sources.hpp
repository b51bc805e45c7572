#pragma once

#include <cstdint>
#include <functional>

#include "emit/kept_points.hpp"

/// The half of read_kept() and read_kept_in_order() that reads sources.
namespace knap {

/// In any order; take() may be called from all workers at once.
void read_sources(const KeptPoints& kept, int workers, const TakeKept& take,
                  const std::function<void(std::uint64_t)>& advance);

/// By ascending id; take() is called by one thread at a time.
void read_sources_in_order(const KeptPoints& kept, int workers, const TakeKept& take,
                           const std::function<void(std::uint64_t)>& advance);

}  // namespace knap

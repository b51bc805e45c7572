#include "store/source_table.hpp"

#include <utility>

namespace knap {

SourceTable::SourceTable(std::vector<SourceEntry> entries, const Box& box)
    : sources_(std::move(entries)), box_(box) {
    formats_.reserve(sources_.size());
    first_ids_.reserve(sources_.size());
    for (SourceEntry& entry : sources_) {
        entry.first_id = points_;
        points_ += entry.points;
        rejected_ += entry.rejected;
        wide_ = wide_ || entry.info.coordinates.kind == CoordinateKind::kFloat64;
        const CoordinateFormat& format = entry.info.coordinates;
        formats_.push_back(format);
        axes_.push_back({format.axis(0), format.axis(1), format.axis(2)});
        first_ids_.push_back(entry.first_id);
    }
}

std::vector<SourceInfo> SourceTable::infos() const {
    std::vector<SourceInfo> infos;
    infos.reserve(sources_.size());
    for (const SourceEntry& entry : sources_) {
        infos.push_back(entry.info);
    }
    return infos;
}

}  // namespace knap

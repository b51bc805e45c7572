#include "store/source_table.hpp"

#include <utility>

namespace knap {

SourceTable::SourceTable(std::vector<SourceEntry> entries, const Box& box)
    : sources_(std::move(entries)), box_(box) {
    first_ids_.reserve(sources_.size());
    for (SourceEntry& entry : sources_) {
        entry.first_id = points_;
        points_ += entry.points;
        rejected_ += entry.rejected;
        wide_ = wide_ || entry.info.coordinates.kind == CoordinateKind::kFloat64;
        first_ids_.push_back(entry.first_id);
    }
    codecs_.reserve(sources_.size());
    for (const SourceEntry& entry : sources_) {
        codecs_.emplace_back(wide_ ? CoordinateFormat{} : entry.info.coordinates);
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

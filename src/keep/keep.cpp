#include "keep/keep.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <mutex>
#include <set>
#include <string_view>

#include "base/scalar.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

using Variable = KeepExpression::Variable;

constexpr std::uint64_t kRangePoints = 1 << 20;
constexpr std::size_t kChunkPoints = 1 << 14;
constexpr std::array<std::string_view, 3> kAxes{"x", "y", "z"};

int axis_of(const Variable& variable) {
    const auto* const found = std::find(kAxes.begin(), kAxes.end(), variable.name);
    return found == kAxes.end() ? -1 : static_cast<int>(found - kAxes.begin());
}

/// Where a source has the value of a variable.
struct Reading {
    int axis = -1;               ///< of a coordinate
    std::ptrdiff_t column = -1;  ///< of a chunk; -1 and no axis: 0
    std::size_t component = 0;
    Attribute attribute;
};

/// How one source is read for an expression.
struct SourcePlan {
    std::vector<std::size_t> columns;  ///< indices in its schema, to be selected in this order
    std::vector<Reading> readings;     ///< one for each variable
};

const Attribute* find_attribute(const SourceInfo& source, const std::string& name) {
    for (const std::size_t i : attributes_of(source)) {
        if (source.schema[i].name == name) {
            return &source.schema[i];
        }
    }
    return nullptr;
}

SourcePlan plan_source(const KeepExpression& expression, const SourceInfo& source) {
    SourcePlan plan;
    for (const Variable& variable : expression.variables()) {
        Reading reading;
        reading.axis = axis_of(variable);
        reading.component = variable.component;
        const Attribute* const attribute =
            reading.axis >= 0 ? nullptr : find_attribute(source, variable.name);
        if (attribute != nullptr) {
            const auto index = static_cast<std::size_t>(attribute - source.schema.data());
            const auto known = std::find(plan.columns.begin(), plan.columns.end(), index);
            reading.column = known - plan.columns.begin();
            reading.attribute = *attribute;
            if (known == plan.columns.end()) {
                plan.columns.push_back(index);
            }
        }
        plan.readings.push_back(reading);
    }
    return plan;
}

double value_of(const Reading& reading, const Chunk& chunk, std::size_t point) {
    if (reading.axis >= 0) {
        return chunk.positions[point][reading.axis];
    }
    if (reading.column < 0) {
        return 0;
    }
    const Attribute& attribute = reading.attribute;
    const std::byte* const at = chunk.columns[static_cast<std::size_t>(reading.column)].data() +
                                point * attribute.value_size() +
                                reading.component * size_of(attribute.type);
    const double stored = visit_scalar(attribute.type, [&](auto tag) {
        typename decltype(tag)::Type value;
        std::memcpy(&value, at, sizeof value);
        return static_cast<double>(value);
    });
    return stored * attribute.scale + attribute.offset;
}

}  // namespace

void check_keep(const KeepExpression& expression, std::span<const SourceInfo> sources) {
    for (const Variable& variable : expression.variables()) {
        if (axis_of(variable) >= 0) {
            continue;
        }
        bool found = false;
        std::set<std::string> names(kAxes.begin(), kAxes.end());
        for (const SourceInfo& source : sources) {
            for (const std::size_t i : attributes_of(source)) {
                names.insert(source.schema[i].name);
            }
            const Attribute* const attribute = find_attribute(source, variable.name);
            found = found || attribute != nullptr;
            if (attribute != nullptr &&
                variable.component >= static_cast<std::size_t>(attribute->components)) {
                throw ConfigError(fmt::format(
                    "range.keep (--keep): expected a component of {} below {}, found {} ({})",
                    variable.name, attribute->components, variable.component,
                    source.path.string()));
            }
        }
        if (!found) {
            throw ConfigError(fmt::format("range.keep (--keep): expected one of {}, found {}",
                                          fmt::join(names, ", "), variable.name));
        }
    }
}

std::vector<std::vector<std::size_t>> columns_of(const KeepExpression& expression,
                                                 std::span<const SourceInfo> sources) {
    std::vector<std::vector<std::size_t>> columns;
    columns.reserve(sources.size());
    for (const SourceInfo& source : sources) {
        columns.push_back(plan_source(expression, source).columns);
    }
    return columns;
}

void find_held(const KeepExpression& expression, const SourceTable& sources,
               const StagedPoints& staged, const StagedReader::Note& note, int workers,
               const std::function<void(const HeldPoints&)>& take,
               const std::function<void(std::uint64_t)>& advance) {
    const std::vector<SourceInfo> infos = sources.infos();
    check_keep(expression, infos);
    std::vector<SourcePlan> plans;
    plans.reserve(infos.size());
    for (const SourceInfo& info : infos) {
        plans.push_back(plan_source(expression, info));
    }
    const StagedReader reader(sources, &staged, columns_of(expression, infos), note);
    const std::vector<ArchivePart> parts = reader.parts(kRangePoints);
    std::mutex mutex;
    const auto consume = [&](std::size_t, std::size_t part, const Chunk& chunk) {
        const std::size_t number = parts[part].range.source;
        const SourceEntry& source = sources.sources()[number];
        if (chunk.first + chunk.positions.size() > source.points) {
            throw InputError(fmt::format("{}: expected {} points as in the survey, found more",
                                         source.info.path.string(), source.points));
        }
        std::vector<PointId> ids;
        std::vector<Vec3> positions;
        std::vector<double> values(plans[number].readings.size());
        for (std::size_t i = 0; i < chunk.positions.size(); ++i) {
            if (!is_finite(chunk.positions[i])) {
                continue;
            }
            for (std::size_t v = 0; v < values.size(); ++v) {
                values[v] = value_of(plans[number].readings[v], chunk, i);
            }
            if (expression.holds(values)) {
                ids.push_back(source.first_id + chunk.first + i);
                positions.push_back(chunk.positions[i]);
            }
        }
        const std::scoped_lock lock(mutex);
        if (!ids.empty()) {
            take({ids, positions});
        }
        advance(chunk.positions.size());
    };
    reader.stream(parts, workers, kChunkPoints, consume);
}

}  // namespace knap

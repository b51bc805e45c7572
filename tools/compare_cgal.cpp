// CGAL fills its quadrics with a matrix that has no values yet.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/IO/PLY.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Edge_collapse_visitor_base.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_placement.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_plane_policies.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>
#include <CGAL/grid_simplify_point_set.h>
#include <CGAL/hierarchy_simplify_point_set.h>
#include <CGAL/random_simplify_point_set.h>
#include <CGAL/wlop_simplify_and_regularize_point_set.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "compare_peer.hpp"
#include "knap/error.hpp"

// CGAL's ways to simplify, peers for tools/compare. CGAL is under the GPL, and so is this program;
// knap itself uses none of it.
//
//   knap_compare_cgal find WAY CLOUD COUNT              prints the parameter that gives about COUNT
//   knap_compare_cgal run WAY CLOUD PARAMETER OUT.ply   prints points kept and seconds
//
// Ways: random, grid, hierarchy and wlop of a point set; collapse of the mesh that a PLY holds.

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Points = std::vector<Kernel::Point_3>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using knap::Simplified;
using knap::Vec3;
using knap::Way;

Points to_cgal(const std::vector<Vec3>& points) {
    Points result;
    result.reserve(points.size());
    for (const Vec3& p : points) {
        result.emplace_back(p.x, p.y, p.z);
    }
    return result;
}

template <typename Range>
Simplified from_cgal(const Range& points, double seconds) {
    Simplified result{.points = {}, .seconds = seconds};
    for (const Kernel::Point_3& p : points) {
        result.points.push_back({p.x(), p.y(), p.z()});
    }
    return result;
}

Simplified by_random(Points points, double percentage) {
    const double seconds = knap::seconds_of(
        [&] { points.erase(CGAL::random_simplify_point_set(points, percentage), points.end()); });
    return from_cgal(points, seconds);
}

Simplified by_grid(Points points, double cell) {
    const double seconds = knap::seconds_of(
        [&] { points.erase(CGAL::grid_simplify_point_set(points, cell), points.end()); });
    return from_cgal(points, seconds);
}

Simplified by_hierarchy(Points points, double size) {
    const auto most = std::max(static_cast<unsigned int>(std::lround(size)), 2U);
    const double seconds = knap::seconds_of([&] {
        points.erase(CGAL::hierarchy_simplify_point_set(points, CGAL::parameters::size(most)),
                     points.end());
    });
    return from_cgal(points, seconds);
}

Simplified by_wlop(Points points, double percentage) {
    Points result;
    const double seconds = knap::seconds_of([&] {
        CGAL::wlop_simplify_and_regularize_point_set<CGAL::Sequential_tag>(
            points, std::back_inserter(result),
            CGAL::parameters::select_percentage(100 - percentage));
    });
    return from_cgal(result, seconds);
}

/// Coincident vertices become one, and what no facet uses is left out.
/// @throws InputError if the PLY holds no facets
Mesh read_mesh(const std::string& path) {
    namespace pmp = CGAL::Polygon_mesh_processing;
    Points points;
    std::vector<std::vector<std::size_t>> facets;
    if (!CGAL::IO::read_PLY(path, points, facets) || facets.empty()) {
        throw knap::InputError(fmt::format("{}: expected a PLY with facets, found none", path));
    }
    pmp::repair_polygon_soup(points, facets);
    pmp::orient_polygon_soup(points, facets);
    Mesh mesh;
    pmp::polygon_soup_to_polygon_mesh(points, facets, mesh);
    return mesh;
}

struct CollapseCounter : CGAL::Surface_mesh_simplification::Edge_collapse_visitor_base<Mesh> {
    explicit CollapseCounter(std::size_t& left) : left_(&left) {}
    void OnCollapsed(const Profile&, const Mesh::Vertex_index&) { --*left_; }

  private:
    std::size_t* left_;
};

/// A collapse takes away one vertex.
struct StopAtVertices {
    const std::size_t* left;
    std::size_t wanted;

    template <typename Cost, typename Profile>
    bool operator()(const Cost&, const Profile&, std::size_t, std::size_t) const {
        return *left <= wanted;
    }
};

/// Quadric errors of planes and the bound on normals, as in CGAL's own example.
Simplified by_collapse(Mesh mesh, double count) {
    namespace sms = CGAL::Surface_mesh_simplification;
    using Policies = sms::GarlandHeckbert_plane_policies<Mesh, Kernel>;
    std::size_t left = mesh.number_of_vertices();
    const double seconds = knap::seconds_of([&] {
        const Policies policies(mesh);
        const sms::Bounded_normal_change_placement<Policies::Get_placement> placement(
            policies.get_placement());
        const StopAtVertices stop{.left = &left,
                                  .wanted = static_cast<std::size_t>(std::lround(count))};
        sms::edge_collapse(mesh, stop,
                           CGAL::parameters::get_cost(policies.get_cost())
                               .get_placement(placement)
                               .visitor(CollapseCounter(left)));
    });
    Points points;
    for (const Mesh::Vertex_index vertex : mesh.vertices()) {
        points.push_back(mesh.point(vertex));
    }
    return from_cgal(points, seconds);
}

Way make_way(const std::string& name, const std::string& cloud) {
    if (name == "collapse") {
        const auto mesh = std::make_shared<const Mesh>(read_mesh(cloud));
        return {.simplify = [mesh](double count) { return by_collapse(*mesh, count); },
                .parameter_for = [](double count) { return count; }};
    }
    const auto all = std::make_shared<const Points>(to_cgal(knap::finite_points(cloud)));
    const auto size = static_cast<double>(all->size());
    const auto with = [all](Simplified (*way)(Points, double)) {
        return [all, way](double parameter) { return way(*all, parameter); };
    };
    const auto percentage = [size](double count) { return 100 - 100 * count / size; };
    if (name == "random") {
        return {.simplify = with(by_random), .parameter_for = percentage};
    }
    if (name == "wlop") {
        return {.simplify = with(by_wlop), .parameter_for = percentage};
    }
    if (name == "hierarchy") {
        return {.simplify = with(by_hierarchy),
                .parameter_for = [size, simplify = with(by_hierarchy)](double count) {
                    return knap::search_parameter(simplify, count, 2, size / count * 8);
                }};
    }
    if (name == "grid") {
        return {.simplify = with(by_grid),
                .parameter_for = [cloud, simplify = with(by_grid)](double count) {
                    return knap::search_parameter(
                        simplify, count, 0, knap::largest_cell(knap::finite_points(cloud), count));
                }};
    }
    throw knap::ConfigError("expected random, grid, hierarchy, wlop or collapse");
}

}  // namespace

int main(int argc, char** argv) {
    return knap::run_peer(argc, argv, "knap_compare_cgal", make_way);
}

#include "evaluate/front_mesh.hpp"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Advancing_front_surface_reconstruction.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <array>
#include <cmath>
#include <iterator>
#include <vector>

#include "knap/error.hpp"

namespace knap {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

}  // namespace

struct FrontMesh::Mesh {
    Triangles triangles;
    Tree tree;
    double area = 0;
    // CGAL's bounds are absolute: it works on a cloud about 1 wide that begins at the origin.
    Vec3 origin;
    double unit = 1;  // cloud units, a power of two

    Point to_mesh(const Vec3& p) const {
        return {(p.x - origin.x) / unit, (p.y - origin.y) / unit, (p.z - origin.z) / unit};
    }
};

FrontMesh::FrontMesh(std::span<const Vec3> points) : mesh_(std::make_unique<Mesh>()) {
    std::vector<Point> corners;
    corners.reserve(points.size());
    Box box;
    for (const Vec3& p : points) {
        box.extend(p);
    }
    if (!box.empty() && box.diagonal() > 0) {
        mesh_->origin = box.min;
        mesh_->unit = std::exp2(std::round(std::log2(box.diagonal())));
    }
    for (const Vec3& p : points) {
        corners.push_back(mesh_->to_mesh(p));
    }
    std::vector<std::array<std::size_t, 3>> facets;
    CGAL::advancing_front_surface_reconstruction(corners.begin(), corners.end(),
                                                 std::back_inserter(facets));
    for (const auto& [a, b, c] : facets) {
        const Kernel::Triangle_3 triangle(corners[a], corners[b], corners[c]);
        if (!triangle.is_degenerate()) {
            mesh_->triangles.push_back(triangle);
            mesh_->area += std::sqrt(CGAL::to_double(triangle.squared_area()));
        }
    }
    if (mesh_->triangles.empty()) {
        throw ConfigError("evaluate: the points of the simplified cloud give no surface");
    }
    mesh_->tree.rebuild(mesh_->triangles.cbegin(), mesh_->triangles.cend());
    mesh_->tree.accelerate_distance_queries();
}

FrontMesh::~FrontMesh() = default;

Surface::Nearest FrontMesh::nearest(const Vec3& p) const {
    const Point query = mesh_->to_mesh(p);
    const double unit = mesh_->unit;
    const auto [foot, facet] = mesh_->tree.closest_point_and_primitive(query);
    const auto normal = facet->supporting_plane().orthogonal_vector();
    const double offset = CGAL::to_double(normal * (query - facet->vertex(0)));
    return {.distance = unit * std::sqrt(CGAL::to_double(CGAL::squared_distance(query, foot))),
            .to_plane = unit * offset / std::sqrt(CGAL::to_double(normal.squared_length()))};
}

double FrontMesh::area() const {
    return mesh_->area * mesh_->unit * mesh_->unit;
}

std::size_t FrontMesh::facets() const {
    return mesh_->triangles.size();
}

}  // namespace knap

#pragma once

#include <memory>
#include <span>

#include "surface/surface.hpp"

namespace knap {

/// The mesh that CGAL's advancing front lays through points, with its default bounds. Built where
/// CGAL is found; what links it is under the GPL.
class FrontMesh final : public Surface {
  public:
    /// @param points  of the simplified cloud, finite
    /// @throws ConfigError if they give no facet
    explicit FrontMesh(std::span<const Vec3> points);
    ~FrontMesh() override;
    FrontMesh(const FrontMesh&) = delete;
    FrontMesh& operator=(const FrontMesh&) = delete;

    Nearest nearest(const Vec3& p) const override;
    double area() const override;
    std::size_t facets() const;

  private:
    struct Mesh;
    std::unique_ptr<Mesh> mesh_;
};

}  // namespace knap

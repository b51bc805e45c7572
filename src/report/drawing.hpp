#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "report/curvature_histogram.hpp"
#include "report/relief.hpp"
#include "report/splats.hpp"
#include "report/view.hpp"
#include "store/ranked_run.hpp"

namespace knap {

/// What is told of a cloud before it is drawn. Counts only, so parts can be added up in any order.
class CloudMeasure {
  public:
    /// @param box         of all points
    /// @param is_terrain  see choose_views()
    CloudMeasure(const Box& box, bool is_terrain, const CurvatureScale& scale);

    void add(std::span<const RankedPoint> points);
    void add(const CloudMeasure& other);

    const CurvatureHistogram& histogram() const { return histogram_; }
    std::vector<Frame> frames() const;

  private:
    CurvatureScale scale_;
    CurvatureHistogram histogram_;
    std::vector<FrameFinder> finders_;
};

/// All points of a cloud, as each view sees them.
class CloudDrawing {
  public:
    /// @param spacing  of the cloud, cloud units
    CloudDrawing(CurvatureHistogram histogram, std::vector<Frame> frames,
                 const CurvatureScale& scale, double spacing);

    /// From any thread.
    void draw(std::span<const RankedPoint> points);

    /// Writes all there is.
    /// @return size of the file
    /// @throws StorageError
    std::uint64_t save(const std::filesystem::path& path) const;

    /// Memory that making the pictures takes, at most.
    static std::uint64_t memory_bytes();
    /// Size of the file, at most.
    static std::uint64_t file_bytes();

  private:
    CurvatureScale scale_;
    double spacing_;
    CurvatureHistogram histogram_;
    std::vector<Frame> frames_;
    std::vector<SplatBuffer> buffers_;
};

/// A drawing on disk.
struct SavedDrawing {
    std::filesystem::path path;
    CurvatureHistogram histogram;
    std::vector<Frame> frames;

    /// @throws StorageError if the file is not what CloudDrawing::save() wrote
    static SavedDrawing load(const std::filesystem::path& path);

    /// @param view  an index into `frames`
    /// @throws StorageError as load()
    SplatBuffer splats(std::size_t view) const;
};

/// The surface of all points, smoothed over about as many pixels as a point's disc has.
/// @param spacing  of the cloud, cloud units
Relief surface_of(const SplatBuffer& splats, const Frame& frame, const CurvatureScale& scale,
                  double spacing);

/// The kept points in one view. Each has the colour and the facing of the surface at its place; one
/// that the surface hides is left out.
class KeptDrawing {
  public:
    enum class Kind {
        kCells,  ///< each where it is the nearest, as far as its range reaches
        kDots    ///< each as a dot of one size
    };

    /// @param surface   of all points; must outlive the object, as must `frame`
    /// @param range_of  the range at a curvature |H|, cloud units
    /// @param kept      points that will be drawn, over all threads
    KeptDrawing(Kind kind, const Frame& frame, const Relief& surface,
                std::function<double(double)> range_of, double spacing, std::uint64_t kept);

    /// From any thread.
    void draw(std::span<const RankedPoint> points);

    /// What was drawn, at the depth of the surface.
    Relief relief() const;

    const SplatBuffer& splats() const { return buffer_; }

  private:
    /// The pixel that shows a place; none if the surface hides it.
    std::optional<std::size_t> pixel_of(const Place& place) const;
    void draw_cell(const Place& place, double reach, const Splat& splat);

    Kind kind_;
    const Frame& frame_;
    const Relief& surface_;
    std::function<double(double)> range_of_;
    double disc_;  // radius of the disc of a point of the surface, pixels
    double dot_ = 1;
    SplatBuffer buffer_;
};

}  // namespace knap

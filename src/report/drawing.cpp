#include "report/drawing.hpp"

#include <algorithm>
#include <cmath>

namespace knap {

namespace {

// Twice what the pictures have.
constexpr int kWidth = 2048;
constexpr int kHeight = 1536;
constexpr std::uint64_t kPixels = std::uint64_t{kWidth} * kHeight;
constexpr std::uint64_t kViews = 2;

// A disc round each point that reaches its neighbours, where points lie evenly.
constexpr double kSplatSpacings = 2;

// Pixels that no kept point reaches, between some that one does.
constexpr int kCellHole = 8;

double splat_radius(const Frame& frame, double spacing) {
    return std::min(kSplatSpacings * spacing / frame.pixel, kWidth / 16.0);
}

}  // namespace

CloudMeasure::CloudMeasure(const Box& box, bool is_terrain, const CurvatureScale& scale)
    : scale_(scale) {
    for (const View& view : choose_views(box, is_terrain)) {
        finders_.emplace_back(view, box);
    }
}

void CloudMeasure::add(std::span<const RankedPoint> points) {
    for (const RankedPoint& point : points) {
        histogram_.add(scale_.code_of(point.key));
        for (FrameFinder& finder : finders_) {
            finder.add(point.position);
        }
    }
}

void CloudMeasure::add(const CloudMeasure& other) {
    histogram_.add(other.histogram_);
    for (std::size_t i = 0; i < finders_.size(); ++i) {
        finders_[i].add(other.finders_[i]);
    }
}

std::vector<Frame> CloudMeasure::frames() const {
    std::vector<Frame> frames;
    for (const FrameFinder& finder : finders_) {
        frames.push_back(finder.frame(kWidth, kHeight));
    }
    return frames;
}

CloudDrawing::CloudDrawing(CurvatureHistogram histogram, std::vector<Frame> frames,
                           const CurvatureScale& scale, double spacing)
    : scale_(scale),
      spacing_(spacing),
      histogram_(std::move(histogram)),
      frames_(std::move(frames)),
      buffers_(frames_.begin(), frames_.end()) {}

void CloudDrawing::draw(std::span<const RankedPoint> points) {
    for (std::size_t i = 0; i < frames_.size(); ++i) {
        const double radius = splat_radius(frames_[i], spacing_);
        for (const RankedPoint& point : points) {
            buffers_[i].draw(frames_[i].place_of(point.position), radius,
                             scale_.code_of(point.key));
        }
    }
}

std::uint64_t CloudDrawing::memory_bytes() {
    // The most is taken while the cells of kept points become a surface: the surface of all points,
    // the cells, and the new surface with a copy whose holes are open. Files and the page are
    // small.
    constexpr std::uint64_t kSurface =
        sizeof(float) + sizeof(std::uint16_t) + sizeof(std::uint32_t);
    constexpr std::uint64_t kFiles = std::uint64_t{16} << 20;
    return kPixels * (sizeof(std::uint64_t) + 3 * kSurface) + kFiles;
}

std::uint64_t CloudDrawing::file_bytes() {
    return kViews * kPixels * sizeof(std::uint64_t) + (std::uint64_t{1} << 16);
}

Relief surface_of(const SplatBuffer& splats, const Frame& frame, const CurvatureScale& scale,
                  double spacing) {
    const double radius = splat_radius(frame, spacing);
    Relief relief = relief_of(splats, static_cast<int>(4 + 2 * std::min(radius, 10.0)),
                              static_cast<float>(6 + 2 * radius));
    const double reach = 3 + 0.75 * radius;
    smooth(relief, scale, static_cast<int>(std::min(reach, 20.0)));
    return relief;
}

KeptDrawing::KeptDrawing(Kind kind, const Frame& frame, const Relief& surface,
                         std::function<double(double)> range_of, double spacing, std::uint64_t kept)
    : kind_(kind),
      frame_(frame),
      surface_(surface),
      range_of_(std::move(range_of)),
      disc_(splat_radius(frame, spacing)),
      buffer_(frame) {
    const auto covered = std::count_if(surface.depth.begin(), surface.depth.end(),
                                       [](float depth) { return depth != Relief::kNothing; });
    // About half of the points face the eye.
    const double pixels =
        2 * static_cast<double>(covered) / static_cast<double>(std::max<std::uint64_t>(kept, 1));
    dot_ = std::clamp(0.3 * std::sqrt(pixels), 1.0, 3.2);
}

std::optional<std::size_t> KeptDrawing::pixel_of(const Place& place) const {
    const double x = std::floor(place.x);
    const double y = std::floor(place.y);
    if (!(x >= 0 && x < surface_.width && y >= 0 && y < surface_.height)) {
        return std::nullopt;
    }
    const std::size_t i = surface_.index(static_cast<int>(x), static_cast<int>(y));
    // The bowl of a disc, and what smoothing moves.
    const double slack = 3 + 2 * disc_;
    const bool is_hidden = place.depth > static_cast<double>(surface_.depth[i]) + slack;
    return is_hidden || surface_.depth[i] == Relief::kNothing ? std::nullopt : std::optional(i);
}

void KeptDrawing::draw(std::span<const RankedPoint> points) {
    for (const RankedPoint& point : points) {
        Place place = frame_.place_of(point.position);
        const std::optional<std::size_t> pixel = pixel_of(place);
        if (!pixel) {
            continue;
        }
        if (kind_ == Kind::kDots) {
            buffer_.draw(place, dot_, surface_.code[*pixel]);
            continue;
        }
        place.depth = static_cast<double>(surface_.depth[*pixel]);
        // As far as the discs of the points that it stands for.
        const double reach = range_of_(point.key) / frame_.pixel + disc_;
        draw_cell(place, std::clamp(reach, 1.5, kWidth / 8.0),
                  {0, surface_.code[*pixel], surface_.facing[*pixel]});
    }
}

// The distance stands in the place of the depth, so that the nearest centre wins.
void KeptDrawing::draw_cell(const Place& place, double reach, const Splat& splat) {
    const PixelSpan rows = pixels_within(place.y, reach, surface_.height);
    const PixelSpan columns = pixels_within(place.x, reach, surface_.width);
    for (int y = rows.first; y <= rows.last; ++y) {
        const double dy = y + 0.5 - place.y;
        for (int x = columns.first; x <= columns.last; ++x) {
            const double dx = x + 0.5 - place.x;
            const double rise =
                static_cast<double>(surface_.depth[surface_.index(x, y)]) - place.depth;
            const double square = dx * dx + dy * dy + rise * rise;
            if (square <= reach * reach) {
                buffer_.offer(x, y, {std::sqrt(square), splat.code, splat.facing});
            }
        }
    }
}

Relief KeptDrawing::relief() const {
    Relief relief = relief_of(buffer_, kCellHole);
    for (std::size_t i = 0; i < relief.depth.size(); ++i) {
        if (relief.depth[i] != Relief::kNothing) {
            relief.depth[i] = surface_.depth[i];
        }
    }
    return relief;
}

}  // namespace knap

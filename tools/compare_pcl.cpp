#include <pcl/console/print.h>
#include <pcl/features/normal_3d.h>
#include <pcl/filters/normal_space.h>
#include <pcl/filters/uniform_sampling.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "compare_peer.hpp"
#include "knap/error.hpp"

// Filters of the Point Cloud Library (BSD), peers for tools/compare.
//
//   knap_compare_pcl find WAY CLOUD COUNT              prints the parameter that gives about COUNT
//   knap_compare_pcl run WAY CLOUD PARAMETER OUT.ply   prints points kept and seconds
//
// Ways: voxel (VoxelGrid: the mean of each cell), uniform (UniformSampling: of each cell the point
// nearest to its middle), normal-space (NormalSpaceSampling, with normals of 20 neighbours).

namespace {

using knap::Simplified;
using knap::Vec3;
using knap::Way;

/// PCL's positions are floats: it gets them relative to the first point, and a label leads back.
struct Input {
    std::vector<Vec3> points;
    pcl::PointCloud<pcl::PointXYZL>::Ptr cloud;
};

Input read_input(const std::string& path) {
    Input input{.points = knap::finite_points(path), .cloud = {}};
    if (input.points.empty()) {
        throw knap::InputError(path + ": expected finite points, found none");
    }
    const Vec3 origin = input.points.front();
    input.cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZL>>();
    input.cloud->reserve(input.points.size());
    for (const Vec3& p : input.points) {
        const auto label = static_cast<std::uint32_t>(input.cloud->size());
        input.cloud->push_back({static_cast<float>(p.x - origin.x),
                                static_cast<float>(p.y - origin.y),
                                static_cast<float>(p.z - origin.z), label});
    }
    return input;
}

/// The points as they were, found by their labels.
Simplified picked(const Input& input, const pcl::PointCloud<pcl::PointXYZL>& kept, double seconds) {
    Simplified result{.points = {}, .seconds = seconds};
    for (const pcl::PointXYZL& p : kept) {
        result.points.push_back(input.points[p.label]);
    }
    return result;
}

Simplified by_voxel(const Input& input, double leaf) {
    pcl::PointCloud<pcl::PointXYZL> kept;
    const double seconds = knap::seconds_of([&] {
        pcl::VoxelGrid<pcl::PointXYZL> filter;
        const auto size = static_cast<float>(leaf);
        filter.setInputCloud(input.cloud);
        filter.setLeafSize(size, size, size);
        filter.setDownsampleAllData(false);  // the mean of the positions alone
        filter.filter(kept);
    });
    const Vec3 origin = input.points.front();
    Simplified result{.points = {}, .seconds = seconds};
    for (const pcl::PointXYZL& p : kept) {
        result.points.push_back({origin.x + p.x, origin.y + p.y, origin.z + p.z});
    }
    return result;
}

Simplified by_uniform(const Input& input, double leaf) {
    pcl::PointCloud<pcl::PointXYZL> kept;
    const double seconds = knap::seconds_of([&] {
        pcl::UniformSampling<pcl::PointXYZL> filter;
        filter.setInputCloud(input.cloud);
        filter.setRadiusSearch(leaf);
        filter.filter(kept);
    });
    return picked(input, kept, seconds);
}

Simplified by_normal_space(const Input& input, double count) {
    constexpr int kNeighbours = 20;
    constexpr unsigned int kBins = 8;  // an axis
    pcl::PointCloud<pcl::PointXYZL> kept;
    const double seconds = knap::seconds_of([&] {
        const auto normals = std::make_shared<pcl::PointCloud<pcl::Normal>>();
        pcl::NormalEstimation<pcl::PointXYZL, pcl::Normal> estimation;
        estimation.setInputCloud(input.cloud);
        estimation.setKSearch(kNeighbours);
        estimation.compute(*normals);
        for (pcl::Normal& normal : *normals) {
            if (!std::isfinite(normal.normal_x)) {
                normal = pcl::Normal(0, 0, 1);  // the filter cannot take others
            }
        }
        pcl::NormalSpaceSampling<pcl::PointXYZL, pcl::Normal> filter;
        filter.setInputCloud(input.cloud);
        filter.setNormals(normals);
        filter.setBins(kBins, kBins, kBins);
        filter.setSample(static_cast<unsigned int>(std::lround(count)));
        filter.setSeed(1);
        filter.filter(kept);
    });
    return picked(input, kept, seconds);
}

Way make_way(const std::string& name, const std::string& cloud) {
    if (name != "voxel" && name != "uniform" && name != "normal-space") {
        throw knap::ConfigError("expected voxel, uniform or normal-space");
    }
    const auto input = std::make_shared<const Input>(read_input(cloud));
    if (name == "normal-space") {
        return {.simplify = [input](double count) { return by_normal_space(*input, count); },
                .parameter_for = [](double count) { return count; }};
    }
    const auto by_leaf = name == "voxel" ? by_voxel : by_uniform;
    const auto simplify = [input, by_leaf](double leaf) { return by_leaf(*input, leaf); };
    return {.simplify = simplify, .parameter_for = [input, simplify](double count) {
                return knap::search_parameter(simplify, count, 0,
                                              knap::largest_cell(input->points, count));
            }};
}

}  // namespace

int main(int argc, char** argv) {
    pcl::console::setVerbosityLevel(pcl::console::L_ERROR);
    return knap::run_peer(argc, argv, "knap_compare_pcl", make_way);
}

#include "sim/barrier/feature_boxes.hpp"

#include <algorithm>
#include <limits>

namespace nbd {
namespace {

/// The boxes of both features.
struct Boxes {
    Boxes() {
        for (int side = 0; side < 2; ++side) {
            low[side].setConstant(std::numeric_limits<double>::infinity());
            high[side].setConstant(-std::numeric_limits<double>::infinity());
        }
    }
    void add(int side, const Eigen::Array3d& p) {
        low[side] = low[side].min(p);
        high[side] = high[side].max(p);
    }
    double apart() const { return (low[0] - high[1]).max(low[1] - high[0]).maxCoeff(); }

    Eigen::Array3d low[2], high[2];
};

int side_of(const FeaturePair& pair, std::size_t corner) {
    return corner < (pair.kind == FeatureKind::vertex_face ? 1u : 2u) ? 0 : 1;
}

}  // namespace

double boxes_apart(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces) {
    const auto at = corners(pair, surfaces);
    Eigen::Array3d frame = Eigen::Array3d::Zero();
    if (pair.surface_a == pair.surface_b)
        frame = surfaces[static_cast<std::size_t>(pair.surface_a)].mean_motion().array();
    Boxes boxes;
    for (std::size_t k = 0; k < 4; ++k) {
        const MovingSurface& surface = surfaces[static_cast<std::size_t>(at[k].surface)];
        boxes.add(side_of(pair, k), surface.begin().row(at[k].vertex).transpose().array());
        boxes.add(side_of(pair, k), surface.end().row(at[k].vertex).transpose().array() - frame);
    }
    return boxes.apart();
}

double boxes_apart_at_begin(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces) {
    const auto at = corners(pair, surfaces);
    Boxes boxes;
    for (std::size_t k = 0; k < 4; ++k)
        boxes.add(
            side_of(pair, k),
            surfaces[static_cast<std::size_t>(at[k].surface)].begin().row(at[k].vertex).transpose().array());
    return boxes.apart();
}

double rest_distance(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces) {
    const Nodes& X = surfaces[static_cast<std::size_t>(pair.surface_a)].rest();
    std::array<Eigen::Vector3d, 4> x;
    const auto at = corners(pair, surfaces);
    for (std::size_t k = 0; k < 4; ++k) x[k] = X.row(at[k].vertex);
    return closest_points(pair.kind, x).distance;
}

}  // namespace nbd

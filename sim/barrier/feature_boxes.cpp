#include "sim/barrier/feature_boxes.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "collision/continuous/feature_pair.hpp"

namespace nbd {

bool may_come_within(double distance, const FeaturePair& pair, const std::vector<MovingSurface>& surfaces) {
    const auto at = corners(pair, surfaces);
    Eigen::Array3d frame = Eigen::Array3d::Zero();
    if (pair.surface_a == pair.surface_b) frame = surfaces[pair.surface_a].mean_motion().array();
    PairBoxes boxes(pair.kind);
    std::array<Eigen::Vector3d, 4> begin, motion;
    for (std::size_t k = 0; k < 4; ++k) {
        const MovingSurface& surface = surfaces[at[k].surface];
        begin[k] = surface.begin(at[k].vertex);
        motion[k] = surface.end(at[k].vertex).transpose() - begin[k];
        boxes.add(k, begin[k].array());
        boxes.add(k, begin[k].array() + (motion[k].array() - frame));
    }
    if (boxes.gaps().maxCoeff() > distance) return false;
    const std::size_t of_a = corners_of_a(pair.kind);
    double most = 0;  // by which corners of the two approach each other
    for (std::size_t k = 0; k < of_a; ++k)
        for (std::size_t l = of_a; l < 4; ++l) most = std::max(most, (motion[k] - motion[l]).squaredNorm());
    return closest_points(pair.kind, begin).distance - std::sqrt(most) <= distance;
}

double boxes_apart_at_begin(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces) {
    const auto at = corners(pair, surfaces);
    PairBoxes boxes(pair.kind);
    for (std::size_t k = 0; k < 4; ++k)
        boxes.add(k, surfaces[at[k].surface].begin(at[k].vertex).transpose().array());
    return boxes.gaps().maxCoeff();
}

double rest_distance(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces) {
    const Nodes& X = surfaces[pair.surface_a].rest();
    std::array<Eigen::Vector3d, 4> x;
    const auto at = corners(pair, surfaces);
    for (std::size_t k = 0; k < 4; ++k) x[k] = X.row(at[k].vertex);
    return closest_points(pair.kind, x).distance;
}

}  // namespace nbd

#include "sim/barrier/feature_boxes.hpp"

#include "collision/continuous/feature_pair.hpp"

namespace nbd {

double boxes_apart(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces) {
    const auto at = corners(pair, surfaces);
    Eigen::Array3d frame = Eigen::Array3d::Zero();
    if (pair.surface_a == pair.surface_b) frame = surfaces[pair.surface_a].mean_motion().array();
    PairBoxes boxes(pair.kind);
    for (std::size_t k = 0; k < 4; ++k) {
        const MovingSurface& surface = surfaces[at[k].surface];
        boxes.add(k, surface.begin(at[k].vertex).transpose().array());
        boxes.add(k, surface.end(at[k].vertex).transpose().array() - frame);
    }
    return boxes.gaps().maxCoeff();
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

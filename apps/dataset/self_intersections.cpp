#include "apps/dataset/self_intersections.hpp"

namespace nbd {

std::int32_t SelfIntersections::count(const Embedding& W, const Nodes& nodes) {
    const Vertices x = embedded(W, Nodes(nodes.cast<float>().cast<double>())).cast<float>();
    posed_.begin_pose(x);
    return query_.intersecting(posed_).size();
}

}  // namespace nbd

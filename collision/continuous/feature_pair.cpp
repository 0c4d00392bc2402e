#include "collision/continuous/feature_pair.hpp"

namespace nbd {

ClosestPoints closest_points(FeatureKind kind, const std::array<Eigen::Vector3d, 4>& x) noexcept {
    return kind == FeatureKind::vertex_face ? closest_point_triangle(x[0], x[1], x[2], x[3])
                                            : closest_edge_edge(x[0], x[1], x[2], x[3]);
}

Impact feature_impact(FeatureKind kind, const std::array<MovingPoint, 4>& x,
                      const ImpactConfig& config) noexcept {
    return kind == FeatureKind::vertex_face ? vertex_face_impact(x[0], x[1], x[2], x[3], config)
                                            : edge_edge_impact(x[0], x[1], x[2], x[3], config);
}

}  // namespace nbd

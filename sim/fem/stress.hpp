#pragma once

#include <Eigen/Core>

#include "sim/fem/elastic_body.hpp"

namespace nbd {

/// Von Mises stress of every tetrahedron in a pose, Pa. It uses the stress of corotated linear elasticity,
/// sigma = 2 mu e + lambda tr(e) I with e = R^T F - I (see ElasticBody), so the body's rotation and damping
/// have no effect. x: [N, 3] metres. Returns [T]; non-finite where the pose is non-finite.
Eigen::VectorXd von_mises_stress(const ElasticBody& body, NodesRef x);

}  // namespace nbd

#pragma once

#include <Eigen/Core>

#include "sim/fem/elastic_body.hpp"

namespace nbd {

/// Von Mises stress of every tetrahedron in a pose, Pa, from the stress of corotated linear elasticity
/// sigma = 2 mu e + lambda tr(e) I, e = R^T F - I (see ElasticBody), which depends neither on the body's
/// turning nor on damping. x: [N, 3] metres. Returns [T]. Non-finite where the pose is.
Eigen::VectorXd von_mises_stress(const ElasticBody& body, NodesRef x);

}  // namespace nbd

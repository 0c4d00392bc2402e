#pragma once

#include <Eigen/Core>

#include "collision/geometry/geometry.hpp"
#include "sim/fem/elastic_body.hpp"

namespace nbd {

/// Von Mises stress of every tetrahedron in a pose, the mean over its points of integration, Pa: of the
/// Cauchy stress P F^T / det F of its law; of corotated tetrahedra that of sigma = 2 mu e + lambda tr(e) I
/// with e = R^T F - I, as the law is linear. The body's rotation and damping have no effect. x: [N, 3]
/// metres. Returns [T]; non-finite where the pose is non-finite or a tetrahedron flat.
Eigen::VectorXd von_mises_stress(const ElasticBody& body, NodesRef x);

/// What the law at each point of integration makes of a pose, for a file.
struct ElementStress {
    Vertices F;  // [3 points, 3] deformation gradients dx/dX, three rows a point
    Vertices P;  // [3 points, 3] first Piola-Kirchhoff stresses dpsi/dF, likewise, Pa
};

/// The gradients and elastic stresses that the forces of a pose are made of; damping is left out. x: [N, 3]
/// metres. Non-finite where the pose is.
ElementStress element_stress(const ElasticBody& body, NodesRef x);

}  // namespace nbd

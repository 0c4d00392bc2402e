#pragma once

#include "collision/box.hpp"
#include "collision/local_model.hpp"
#include "collision/modal_model.hpp"

namespace nbd {

/// The formulas of the bounds as one would write them down, with Eigen's vectors of any size.

Sphere plain_local_sphere(const LocalModel& model, int node, VerticesRef x);
/// Grown as far as training says, without a margin.
Box plain_local_box(const LocalModel& model, int node, VerticesRef x);
/// zn: the scaled code. The sphere in the aligned frame.
Sphere plain_modal_sphere(const ModalModel& model, const SphereTree& tree, int node,
                          const Eigen::VectorXf& zn);
/// The code itself, not scaled.
Eigen::VectorXf plain_modal_code(const ClusteredModes& modes, VerticesRef x);

}  // namespace nbd

#pragma once

#include <Eigen/Core>
#include <vector>

#include "collision/bounds/learned/learned_model.hpp"
#include "collision/bounds/learned/nbd_model.hpp"
#include "collision/geometry/box.hpp"

namespace nbd {

/// The bounds' formulas in plain Eigen, with vectors of dynamic size.

Sphere plain_learned_sphere(const LearnedModel& model, int node, VerticesRef x);
/// Box with the trained growth, without a margin.
Box plain_learned_box(const LearnedModel& model, int node, VerticesRef x);

/// NBD bounds with all numbers in float.
class PlainNbd {
 public:
    /// model: kept by reference.
    explicit PlainNbd(const NbdModel& model);
    /// The node's sphere in the aligned frame. zn: scaled modal coordinates.
    Sphere sphere(const SphereTree& tree, int node, const Eigen::VectorXf& zn) const;
    /// The modal coordinates of a pose, not scaled.
    Eigen::VectorXf coordinates(VerticesRef x) const;

 private:
    const NbdModel* model_;
    Eigen::MatrixXf U_, centre_map_;
    std::vector<float> weights_;
};

}  // namespace nbd

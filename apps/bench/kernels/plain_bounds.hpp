#pragma once

#include <Eigen/Core>
#include <vector>

#include "collision/bounds/learned/learned_model.hpp"
#include "collision/bounds/learned/nbd_model.hpp"
#include "collision/geometry/box.hpp"

namespace nbd {

/// The formulas of the bounds as one would write them down, with Eigen's vectors of any size.

Sphere plain_learned_sphere(const LearnedModel& model, int node, VerticesRef x);
/// Grown as far as training says, without a margin.
Box plain_learned_box(const LearnedModel& model, int node, VerticesRef x);

/// Nbd bounds with all numbers in float.
class PlainNbd {
 public:
    /// model: referred to.
    explicit PlainNbd(const NbdModel& model);
    /// zn: the scaled code. The sphere in the aligned frame.
    Sphere sphere(const SphereTree& tree, int node, const Eigen::VectorXf& zn) const;
    /// The code itself, not scaled.
    Eigen::VectorXf code(VerticesRef x) const;

 private:
    const NbdModel* model_;
    Eigen::MatrixXf U_, centre_map_;
    std::vector<float> weights_;
};

}  // namespace nbd

#pragma once

#include <Eigen/Core>
#include <vector>

#include "collision/box.hpp"
#include "collision/local_model.hpp"
#include "collision/modal_model.hpp"

namespace nbd {

/// The formulas of the bounds as one would write them down, with Eigen's vectors of any size.

Sphere plain_local_sphere(const LocalModel& model, int node, VerticesRef x);
/// Grown as far as training says, without a margin.
Box plain_local_box(const LocalModel& model, int node, VerticesRef x);

/// Modal bounds with all numbers in float.
class PlainModal {
 public:
    /// model: referred to.
    explicit PlainModal(const ModalModel& model);
    /// zn: the scaled code. The sphere in the aligned frame.
    Sphere sphere(const SphereTree& tree, int node, const Eigen::VectorXf& zn) const;
    /// The code itself, not scaled.
    Eigen::VectorXf code(VerticesRef x) const;

 private:
    const ModalModel* model_;
    Eigen::MatrixXf U_, centre_map_;
    std::vector<float> weights_;
};

}  // namespace nbd

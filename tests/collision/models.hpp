#pragma once

#include <memory>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "tests/support/shapes.hpp"

namespace nbd::shapes {

/// Smooth displacement modes of a surface, [3 n, m], and representatives among its vertices. Like elastic
/// modes they are orthogonal to rigid motions under the representatives' weights, so a pose X + U q is
/// already aligned.
struct Modes {
    Eigen::MatrixXf U;
    ClusteredModes clustered;
};

Modes make_modes(const Surface& s, int mode_count, int representatives, unsigned seed);

/// Returns the pose X + U q.
Vertices nbd_pose(const Surface& s, const Eigen::MatrixXf& U, const Eigen::VectorXf& q);

FixedVector fixed(const Eigen::VectorXf& numbers);

Sphere nbd_sphere(const NbdModel& model, const SphereTree& tree, int node, const FixedVector& zn);

/// A model with random weights, similar to the start of training.
NbdModel random_model(const SphereTree& tree, const ClusteredModes& modes, int hidden, unsigned seed);

/// A model over evenly spaced vertices of each part, with made-up growths. tree: has `boxes`.
std::shared_ptr<const LearnedAffineModel> sampled_affine_model(const CollisionTree& tree, VerticesRef X);

/// A tree of a surface with every kind of bounds except affine.
CollisionTree full_tree(const Surface& s, const Modes& modes, const SphereTreeConfig& config = {});

/// Likewise, shared, with modes of make_modes().
std::shared_ptr<const CollisionTree> shared_full_tree(const Surface& s, int mode_count, int representatives,
                                                      unsigned seed, const SphereTreeConfig& config = {});

/// The kinds of bounds that a tree has.
std::vector<BoundKind> kinds_of(const CollisionTree& tree);

/// A calibration with margins of 0, for tests that ask for bounds as they are.
Calibration no_margins(const CollisionTree& tree, BoundKind kind);

}  // namespace nbd::shapes

#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "collision/continuous/feature_pair.hpp"
#include "collision/tree/posed_tree.hpp"
#include "sim/patches/surface_normals.hpp"

namespace nbd {

/// A surface whose vertices move straight from one pose to another, with a tree for queries over the motion.
/// Positions are in double precision, metres.
class MovingSurface {
 public:
    /// rest: positions in which the surface does not touch itself, [n, 3]. body: number of the body, or -1
    /// for an obstacle.
    MovingSurface(const Faces& F, Nodes rest, int body);

    /// Both [n, 3].
    void move(Nodes begin, Nodes end);

    int body() const noexcept { return body_; }
    bool is_obstacle() const noexcept { return body_ < 0; }
    const Faces& F() const noexcept { return F_; }
    const SurfaceTopology& topology() const noexcept { return topology_; }
    NumberedSurface numbered(int surface) const noexcept { return {surface, F_, topology_}; }
    const Nodes& rest() const noexcept { return rest_; }
    const Eigen::VectorXd& rest_areas() const noexcept { return areas_; }  // [n] m2
    const Nodes& begin() const noexcept { return begin_; }
    const Nodes& end() const noexcept { return end_; }
    /// Position of a vertex after a share of the motion.
    Eigen::Vector3d at(int vertex, double share) const noexcept {
        return begin_.row(vertex) + share * (end_.row(vertex) - begin_.row(vertex));
    }
    /// In this motion; see PosedTree::begin_step().
    PosedTree& tree() noexcept { return tree_; }
    /// The same relative to the mean motion of the vertices, for queries of the surface with itself.
    PosedTree& own_tree() noexcept { return own_tree_; }
    const Eigen::Vector3d& mean_motion() const noexcept { return mean_motion_; }
    /// By how much the positions that the tree sees may be off, metres.
    double rounding() const noexcept;

 private:
    int body_;
    Faces F_;
    SurfaceTopology topology_;
    Nodes rest_, begin_, end_;
    Eigen::VectorXd areas_;
    Eigen::Vector3d mean_motion_ = Eigen::Vector3d::Zero();
    PosedTree tree_, own_tree_;
    Vertices begin_float_, end_float_, own_end_float_;  // of the trees' steps
};

/// A corner of a feature: a vertex of a surface.
struct FeatureCorner {
    int surface, vertex;
};

/// The vertex and the corners of the face, or the ends of edge a and of edge b.
std::array<FeatureCorner, 4> corners(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces);

}  // namespace nbd

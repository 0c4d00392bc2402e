#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "collision/continuous/feature_pair.hpp"
#include "collision/tree/posed_tree.hpp"
#include "sim/barrier/host_proof.hpp"
#include "sim/patches/contact_shape.hpp"

namespace nbd {

/// By what the faces of a surface are culled that stay away from those of others.
struct PairBounds {
    std::shared_ptr<const CollisionTree> tree{};  // of the surface; null: exact bounds, of a tree of its own
    BoundKind kind = BoundKind::exact;            // `auto`: as exact_for_auto() says
    std::optional<float> margin{};  // relative, of the tree's spheres; none: PosedTree's default
};

/// A surface whose vertices move straight from one pose to another, with trees for queries over the motion.
/// Positions are in double precision, metres.
///
/// A surface that is much finer than the tetrahedra that carry it, and does not leave them, hangs on their
/// nodes: a motion costs what is asked of it, and its trees are bounded by the nodes. All others are placed
/// vertex by vertex.
class MovingSurface {
 public:
    /// Of a body. tets: at rest. body: its number. Throws as PosedTree() where the bounds cannot be used.
    MovingSurface(std::shared_ptr<const ContactShape> shape, const TetMesh& tets, int body,
                  const PairBounds& bounds = {});
    /// Of another body of the same shape.
    MovingSurface(const MovingSurface& twin, int body, const PairBounds& bounds = {});
    /// Of an obstacle, or of a body whose vertices are its nodes. rest: [n, 3]. body: of an obstacle
    /// party_of_obstacle(), or any number below 0.
    MovingSurface(const Faces& F, const Nodes& rest, int body);

    /// Positions of the nodes at both ends of the motion, both [N, 3].
    void move(Nodes begin, Nodes end);

    int body() const noexcept { return body_; }
    bool is_obstacle() const noexcept { return body_ < 0; }
    const ContactShape& shape() const noexcept { return *shape_; }
    const Faces& F() const noexcept { return shape_->F; }
    const SurfaceTopology& topology() const noexcept { return shape_->topology; }
    NumberedSurface numbered(int surface) const noexcept { return {surface, F(), topology()}; }
    const Nodes& rest() const noexcept { return rest_; }
    const Nodes& rest_nodes() const noexcept { return rest_nodes_; }
    const Eigen::VectorXd& rest_areas() const noexcept { return shape_->rest_areas; }  // [n] m2

    bool hangs_on_nodes() const noexcept { return hangs_on_nodes_; }
    /// What the motion is given by, at both ends: nodes of a surface that hangs on them, else the vertices.
    /// The vertices are their means with weights that are not negative.
    const Nodes& begin_points() const noexcept { return begin_; }
    const Nodes& end_points() const noexcept { return end_; }

    Eigen::RowVector3d begin(int vertex) const noexcept { return position(vertex, begin_, placed_.begin); }
    Eigen::RowVector3d end(int vertex) const noexcept { return position(vertex, end_, placed_.end); }
    /// Computes the corners of these faces once for many looks: begin() and end() look them up until the next
    /// motion. face: which of the two faces of each pair.
    void place_corners(std::span<const FacePair> pairs, int FacePair::*face);
    /// Position of a vertex after a share of the motion.
    Eigen::Vector3d at(int vertex, double share) const noexcept {
        const Eigen::RowVector3d from = begin(vertex);
        return from + share * (end(vertex) - from);
    }
    /// In this motion, for queries with other surfaces; see PosedTree::begin_step().
    PosedTree& tree() noexcept { return exact_tree_ ? *exact_tree_ : tree_; }
    /// Exact, and relative to the mean motion of the points, for queries of the surface with itself.
    PosedTree& own_tree() noexcept { return own_tree_; }
    /// Exact, for queries with itself and others, where the motion ends as it begins.
    PosedTree& still_tree() noexcept { return is_obstacle() ? tree_ : own_tree_; }
    /// Whether tree() can miss faces that come near.
    bool can_miss() const noexcept { return !exact_tree_ && nbd::can_miss(tree_.kind()); }
    /// Whether tree() has exact bounds in the next motions, rather than those that were given.
    void be_exact(bool exact);
    /// Tells which of its faces need no look in this motion. None unless tetrahedra carry the surface.
    const std::optional<HostProof>& proof() const noexcept { return proof_; }
    /// By how much the positions that the tree sees may be off, metres.
    double rounding() const noexcept;

 private:
    Eigen::RowVector3d position(int vertex, const Nodes& points, const Nodes& placed) const noexcept {
        if (!hangs_on_nodes_) return points.row(vertex);
        return is_placed_[vertex] ? placed.row(vertex) : hanging_position(vertex, points);
    }
    Eigen::RowVector3d hanging_position(int vertex, const Nodes& points) const noexcept;
    void find_hosts(const TetMesh& tets);
    void begin_step(PosedTree& tree) const;

    std::shared_ptr<const ContactShape> shape_;
    int body_;
    bool hangs_on_nodes_;
    int most_carriers_;  // nodes that a vertex hangs on
    Nodes rest_nodes_, rest_, begin_, end_;
    std::shared_ptr<const CollisionTree> shared_tree_;
    PosedTree tree_, own_tree_;
    std::optional<PosedTree> exact_tree_;  // in place of tree_
    std::shared_ptr<const HostNeighbours> hosts_;
    std::optional<HostProof> proof_;
    /// Positions at both ends, as trees have them.
    struct Ends {
        Vertices begin, end;
    };
    Ends nodes_, vertices_;  // those that a tree reads
    Vertices own_end_;       // of own_tree_
    double largest_ = 0;     // coordinate that trees read
    /// Of a surface that hangs on nodes: vertices that place_corners() computed for this motion.
    struct Placed {
        Nodes begin, end;  // [n, 3]
    };
    Placed placed_;
    std::vector<char> is_placed_;  // [n]
    std::vector<int> placed_vertices_;
};

/// A corner of a feature: a vertex of a surface.
struct FeatureCorner {
    int surface, vertex;
};

/// The vertex and the corners of the face, or the ends of edge a and of edge b.
std::array<FeatureCorner, 4> corners(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces);

}  // namespace nbd

#pragma once

#include <memory>
#include <optional>
#include <variant>

#include "collision/bounds/affine/affine_boxes.hpp"
#include "collision/bounds/certified/certified_bound.hpp"
#include "collision/bounds/exact/exact_bound.hpp"
#include "collision/bounds/exact/exact_boxes.hpp"
#include "collision/bounds/learned/bd_bound.hpp"
#include "collision/bounds/learned/learned_boxes.hpp"
#include "collision/bounds/learned/learned_spheres.hpp"
#include "collision/bounds/learned/nbd_bound.hpp"
#include "collision/tree/auto_choice.hpp"
#include "collision/tree/leaf_boxes.hpp"
#include "collision/tree/posed_tree.hpp"
#include "collision/tree/sphere_cache.hpp"

namespace nbd {

/// A pose of the sphere tree, its bounds and the boxes under its leaves. Queries take the type of the bounds
/// out of the variant once and then run without a dispatch per node.
struct PosedSpheres {
    std::variant<ExactBound, ExactBoxes, BdBound, NbdBound, LearnedSpheres, LearnedBoxes, CertifiedBound>
        bounds;
    SphereCache spheres;
    LeafBoxes boxes;

    void begin_pose(const Positions& x, std::span<const RegionMotion> motion) noexcept;
    int nodes_bounded() const noexcept;
    int nodes_out_of_range() const noexcept;
    /// Whether something that was read in this pose is not finite, or overflows.
    bool met_non_finite() const noexcept;
};

/// What `auto` bounds that may be learned keep beside the pose, for their choice.
struct AutoPose {
    AutoChoice choice{};
    bool was_tried = false;                            // by a query of this pose
    AutoChoice::Trial boxes_trial{}, learned_trial{};  // of this pose's queries that used both
    double boxes_work = 0, learned_work = 0;           // of all queries of this pose

    /// Time that this pose took to begin in both trees, so far.
    double starts_ns() const noexcept { return boxes_trial.start_ns + learned_trial.start_ns; }
    void add_trial(const AutoChoice::Trial& boxes, const AutoChoice::Trial& learned) noexcept;
    /// Adds the pose that ends to the choice.
    void end_pose() noexcept;
};

/// The data of a PosedTree, visible to the queries. It has a wide tree, a sphere tree or both, and each
/// begins a pose when it is first needed.
struct PosedTreeState {
    std::shared_ptr<const CollisionTree> tree;
    BoundKind kind;
    std::optional<float> margin{};
    std::unique_ptr<PosedSpheres> posed_spheres{};        // null: not needed so far
    std::optional<AffineBoxes> of_nodes{}, of_surface{};  // wide trees; empty: not needed so far
    std::optional<AffineBoxes> of_samples{};              // for `auto` bounds that may be learned affine ones
    bool is_wide = false;                 // has the bounds of a wide tree, perhaps among others
    std::optional<AutoPose> automatic{};  // for `auto` bounds that may be learned
    Positions positions{};                // of the pose
    VertexView given{}, given_start{};    // what the pose or step was given by: positions or nodes
    bool given_nodes = false;             // it was nodes
    Vertices surface{};                   // `positions` that were made from nodes
    bool is_of_nodes = false;             // the pose or step was given by nodes
    bool in_step = false;                 // a step, whose end is the pose
    bool wide_is_stale = false;           // of_surface has another pose
    bool samples_are_stale = false;       // of_samples has another pose
    bool spheres_are_stale = false;       // posed_spheres has another pose
    bool asks_learned = false;            // the query uses the learned ones of `auto` bounds
    bool goes_wide = false;               // and the wide trees

    PosedTreeState(std::shared_ptr<const CollisionTree> body, BoundKind bounds, std::optional<float> growth);

    /// Start a pose or a step, see PosedTree, and check what they read.
    void begin_pose(VertexView x, std::span<const RegionMotion> motion);
    void begin_pose(EmbeddedPositions& x, std::span<const RegionMotion> motion);
    void begin_pose_of_nodes(VertexView nodes);
    void begin_step(VertexView start, VertexView end);
    void begin_step_of_nodes(VertexView start, VertexView end);

    /// Throws std::invalid_argument, naming the first vertex or node, if a number that was read in this pose
    /// so far is not finite. Queries call it before they answer.
    void require_finite() const;

    bool has_pose() const noexcept { return given.count() > 0; }
    /// Whether wide() has boxes that are not learned ones of `auto`: by the body's kind, or in a step.
    bool has_boxes() const noexcept { return is_wide || in_step; }
    /// Whether the query may use wide().
    bool has_wide() const noexcept { return asks_learned ? of_samples.has_value() : has_boxes(); }

    /// The boxes of the wide tree in this pose, or the learned ones if the query asks for these.
    AffineBoxes& wide();
    /// The sphere tree in this pose. For `boxes` and `affine` it has exact boxes, and reads the whole
    /// surface.
    PosedSpheres& spheres();

 private:
    /// Calls start(), which begins a pose or a step. If it throws, or read what is not finite, there is no
    /// pose, and the error goes on.
    template <class Start>
    void begin(const Start& start);
    void forget_pose() noexcept;
    PosedSpheres& made_spheres();  // in whatever pose
    void set_pose(const Positions& x, std::span<const RegionMotion> motion);
    bool met_non_finite() const noexcept;
    void check_motion(std::span<const RegionMotion> motion) const;
    void check_rows(const char* what, const VertexView& x) const;
    void check_nodes(const char* what, const VertexView& x) const;
};

/// Whether a body's `auto` bounds may be learned in this pose.
inline bool may_be_learned(const PosedTreeState& body) noexcept {
    return body.automatic && !body.is_of_nodes && !body.in_step;
}
/// Begin a query between two bodies, or with one alone: they decide whether it uses learned bounds, by their
/// costs or as said. Return whether it walks the bodies' wide trees; else it walks their sphere trees.
bool choose_bounds(PosedTreeState& a, PosedTreeState& b) noexcept;
bool choose_bounds(PosedTreeState& a, PosedTreeState& b, bool learned) noexcept;

}  // namespace nbd

#pragma once

#include <map>
#include <memory>
#include <optional>

#include "collision/bounds/calibration.hpp"
#include "collision/nbd_tree/bd_bound.hpp"
#include "collision/nbd_tree/nbd_bound.hpp"
#include "collision/nbd_tree/sphere_tree.hpp"
#include "collision/tree/bound_kind.hpp"
#include "collision/wide_tree/affine_model.hpp"
#include "collision/wide_tree/learned_affine.hpp"

namespace nbd {

/// Everything that collision queries need to know about a body, independent of its pose. All copies of the
/// body share one; a tree file holds one.
struct CollisionTree {
    int vertex_count = 0;
    Faces faces;
    SphereTree spheres;
    std::optional<BdModel> bd;                                 // absent: the bound cannot be used
    std::optional<NbdModel> nbd;                               // likewise
    std::shared_ptr<const LearnedAffineModel> learned_affine;  // likewise; over the wide tree of make_boxes()
    std::shared_ptr<const AffineModel> affine;                 // likewise; see hang_on_nodes()
    std::shared_ptr<const AffineModel> boxes;       // absent: each PosedTree with `boxes` makes its own
    std::map<BoundKind, Calibration> calibrations;  // absent: the bound has no stated miss rate
};

/// A tree with exact bounds only, from rest positions X and faces F. Throws as build_sphere_tree().
CollisionTree make_exact_tree(VerticesRef X, FacesRef F, const SphereTreeConfig& config = {});

/// What `boxes` need. tree: passed check_collision_tree().
std::shared_ptr<const AffineModel> make_boxes(const CollisionTree& tree);

/// Gives a tree `affine` bounds: its surface hangs on nodes, x = W nodes. rest: rest positions of the nodes,
/// [nodes, 3]. Throws as AffineModel.
void hang_on_nodes(CollisionTree& tree, const SurfaceEmbedding& W, VerticesRef rest);

/// The same tree as a shared pointer, as PosedTree takes it.
std::shared_ptr<const CollisionTree> shared_exact_tree(VerticesRef X, FacesRef F,
                                                       const SphereTreeConfig& config = {});

/// Returns a pointer for PosedTree that does not own the tree; the tree must outlive it.
inline std::shared_ptr<const CollisionTree> refer_to(const CollisionTree& tree) noexcept {
    return {std::shared_ptr<const void>(), &tree};
}
std::shared_ptr<const CollisionTree> refer_to(CollisionTree&&) = delete;

/// Validates a tree read from a file. Throws std::invalid_argument, saying what is wrong, unless all parts of
/// the tree fit each other.
void check_collision_tree(const CollisionTree& tree);

/// Throws std::invalid_argument if the tree has no bounds besides those that every tree has: for a file that
/// held bounds that are gone.
void require_other_bounds(const CollisionTree& tree);

/// Number of bounds of this kind that have a margin of their own: nodes of the sphere tree, or of a model
/// over a wide tree.
std::size_t bound_count(const CollisionTree& tree, BoundKind kind) noexcept;

/// The margins of bounds of a kind, as PosedTree takes them: those of the calibration unless one is given.
NodeMargins node_margins(const CollisionTree& tree, BoundKind kind, std::optional<float> margin);

/// Whether the tree has the model that bounds of this kind need.
bool has_bounds(const CollisionTree& tree, BoundKind kind) noexcept;

/// Whether the tree has bounds of this kind that keep what they promise: bounds that never miss, or ones
/// whose margin is calibrated in the tree or given.
bool is_usable(const CollisionTree& tree, BoundKind kind, std::optional<float> margin) noexcept;

}  // namespace nbd

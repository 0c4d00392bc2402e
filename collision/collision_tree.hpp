#pragma once

#include <map>
#include <optional>
#include <string_view>

#include "collision/bd_model.hpp"
#include "collision/calibration.hpp"
#include "collision/certified/certified_model.hpp"
#include "collision/local_model.hpp"
#include "collision/modal_model.hpp"
#include "collision/sphere_tree.hpp"

namespace nbd {

enum class BoundKind { exact, boxes, bd, modal, local, local_boxes, certified, automatic };

/// All of them, in order.
inline constexpr BoundKind bound_kinds[] = {BoundKind::exact,     BoundKind::boxes,    BoundKind::bd,
                                            BoundKind::modal,     BoundKind::local,    BoundKind::local_boxes,
                                            BoundKind::certified, BoundKind::automatic};

/// "exact", "boxes", "bd", "modal", "local", "local_boxes", "certified", "auto".
std::string_view name(BoundKind kind) noexcept;

/// Whether bounds of this kind are the smallest there are and need no more than the surface.
constexpr bool is_exact(BoundKind kind) noexcept {
    return kind == BoundKind::exact || kind == BoundKind::boxes;
}

/// Whether a vertex of a node may stand outside such a bound, so that it wants a calibration of its own
/// (`auto` has that of `local_boxes`).
constexpr bool can_miss(BoundKind kind) noexcept {
    return !is_exact(kind) && kind != BoundKind::certified && kind != BoundKind::automatic;
}

/// Whether such a bound is an axis-aligned box; the others are spheres.
constexpr bool is_box(BoundKind kind) noexcept {
    return kind == BoundKind::boxes || kind == BoundKind::local_boxes || kind == BoundKind::automatic;
}

/// Throws std::invalid_argument naming the known kinds.
BoundKind bound_kind(std::string_view name);

/// Everything a body needs for collision queries, at rest and for every pose: the same for all copies of
/// the body. A tree file holds one.
struct CollisionTree {
    int vertex_count = 0;
    Faces faces;
    SphereTree spheres;
    std::optional<BdModel> bd;                      // absent: the bound cannot be used
    std::optional<ModalModel> modal;                // likewise
    std::optional<LocalModel> local;                // likewise
    std::optional<CertifiedModel> certified;        // likewise
    std::map<BoundKind, Calibration> calibrations;  // absent: the bound keeps no stated miss rate
};

/// A tree with `exact` bounds alone, from rest positions X and faces F. Throws as build_sphere_tree().
CollisionTree make_exact_tree(VerticesRef X, FacesRef F, const SphereTreeConfig& config = {});

/// Throws std::invalid_argument with what is wrong unless all parts of the tree fit each other: for trees
/// that come from a file.
void check_collision_tree(const CollisionTree& tree);

/// Whether the tree has what bounds of this kind need.
bool has_bounds(const CollisionTree& tree, BoundKind kind) noexcept;

}  // namespace nbd

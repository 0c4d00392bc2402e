#pragma once

#include <string_view>

namespace nbd {

enum class BoundKind {
    exact,
    boxes,
    bd,
    nbd,
    learned_spheres,
    learned_boxes,
    learned_affine,
    certified,
    affine,
    automatic
};

/// All kinds, in order.
inline constexpr BoundKind bound_kinds[] = {BoundKind::exact,
                                            BoundKind::boxes,
                                            BoundKind::bd,
                                            BoundKind::nbd,
                                            BoundKind::learned_spheres,
                                            BoundKind::learned_boxes,
                                            BoundKind::learned_affine,
                                            BoundKind::certified,
                                            BoundKind::affine,
                                            BoundKind::automatic};

/// "exact", "boxes", "bd", "nbd", "learned_spheres", "learned_boxes", "learned_affine", "certified",
/// "affine", "auto".
std::string_view name(BoundKind kind) noexcept;

/// Whether bounds of this kind are computed from all vertices of a node and need no model.
constexpr bool is_exact(BoundKind kind) noexcept {
    return kind == BoundKind::exact || kind == BoundKind::boxes;
}

/// Whether a vertex of a node may lie outside such a bound, so that the kind needs its own calibration
/// (`auto` uses the calibration of `learned_boxes`).
constexpr bool can_miss(BoundKind kind) noexcept {
    return !is_exact(kind) && kind != BoundKind::certified && kind != BoundKind::affine &&
           kind != BoundKind::automatic;
}

/// Whether such a bound is an axis-aligned box; the others are spheres.
constexpr bool is_box(BoundKind kind) noexcept {
    return kind == BoundKind::boxes || kind == BoundKind::learned_boxes ||
           kind == BoundKind::learned_affine || kind == BoundKind::affine || kind == BoundKind::automatic;
}

/// The kind with this name, or with a name from release 0.1. Throws std::invalid_argument, listing the known
/// kinds.
BoundKind bound_kind(std::string_view name);

/// Current name of a kind that release 0.1 called "modal", "local" or "local_boxes", with a notice; returns
/// any other text unchanged.
std::string_view current_bound_name(std::string_view name);

}  // namespace nbd

#pragma once

#include <string>
#include <string_view>

namespace nbd {

/// What bounds the nodes of a body's tree in a pose. Exact ones and `affine` contain every vertex of
/// their node in every pose; the others may miss, at the rate for which they were calibrated.
enum class BoundKind {
    exact,           // spheres around all vertices of a node
    boxes,           // boxes around all vertices
    bd,              // spheres of the BD-Tree [JamesPai04], from modal coordinates
    nbd,             // spheres of the paper's NBD-Tree: a network per node
    learned_affine,  // boxes from an affine map fitted to a few sampled vertices, grown by a learned share
    affine,          // boxes from the nodes that carry the surface
    automatic        // of `affine`, `boxes` and `learned_affine` what is fastest, see bounds_of_auto()
};

/// All kinds, in order.
inline constexpr BoundKind bound_kinds[] = {BoundKind::exact,    BoundKind::boxes,          BoundKind::bd,
                                            BoundKind::nbd,      BoundKind::learned_affine, BoundKind::affine,
                                            BoundKind::automatic};

/// "exact", "boxes", "bd", "nbd", "learned_affine", "affine",
/// "auto".
std::string_view name(BoundKind kind) noexcept;

/// Whether bounds of this kind are computed from all vertices of a node and need no model.
constexpr bool is_exact(BoundKind kind) noexcept {
    return kind == BoundKind::exact || kind == BoundKind::boxes;
}

/// Whether a vertex of a node may lie outside such a bound, so that the kind needs its own calibration.
constexpr bool can_miss(BoundKind kind) noexcept {
    return !is_exact(kind) && kind != BoundKind::affine && kind != BoundKind::automatic;
}

/// Whether such a bound is an axis-aligned box; the others are spheres.
constexpr bool is_box(BoundKind kind) noexcept {
    return kind == BoundKind::boxes || kind == BoundKind::learned_affine || kind == BoundKind::affine ||
           kind == BoundKind::automatic;
}

/// The kind with this name. Throws std::invalid_argument, which lists the known kinds or says what to write
/// instead of a name that is gone.
BoundKind bound_kind(std::string_view name);

/// What to write instead of a name of bounds that is gone; empty for any other text.
std::string_view instead_of_bound(std::string_view name) noexcept;

/// Bounds that are gone, in the group of a tree file that held them. Readers leave it out.
struct GoneBounds {
    std::string_view group, names, instead;
};
inline constexpr GoneBounds gone_bounds[] = {
    {"certified", "certified", "affine, which miss nothing either and need no training"},
    {"learned", "learned_spheres and learned_boxes", "learned_affine, which `nbdtree train` makes"}};

/// One line for the reader of a file: what was left out, and what to use instead.
std::string left_out(const GoneBounds& gone);

}  // namespace nbd

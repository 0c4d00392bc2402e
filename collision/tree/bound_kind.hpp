#pragma once

#include <array>
#include <iterator>
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
    automatic        // of `affine`, `boxes` and `learned_affine` what is fastest, see auto_bounds.hpp
};

/// What is true of the bounds of a kind.
struct BoundTraits {
    BoundKind kind;
    std::string_view name;
    bool is_exact = false;  // computed from all vertices of a node, without a model
    bool can_miss = false;  // a vertex of a node may lie outside, so that the kind needs its own calibration
    bool is_box = false;    // boxes of a wide tree along the axes; the others are spheres of an NBD-Tree
    /// A body reads the nodes that carry its surface and nothing else, where its tree hangs on nodes and
    /// poses give them. `affine` bounds are only of such trees.
    bool reads_nodes = false;
};

/// All kinds, in the order of BoundKind.
inline constexpr BoundTraits all_bound_traits[] = {
    {.kind = BoundKind::exact, .name = "exact", .is_exact = true},
    {.kind = BoundKind::boxes, .name = "boxes", .is_exact = true, .is_box = true},
    {.kind = BoundKind::bd, .name = "bd", .can_miss = true},
    {.kind = BoundKind::nbd, .name = "nbd", .can_miss = true},
    {.kind = BoundKind::learned_affine, .name = "learned_affine", .can_miss = true, .is_box = true},
    {.kind = BoundKind::affine, .name = "affine", .is_box = true, .reads_nodes = true},
    {.kind = BoundKind::automatic, .name = "auto", .is_box = true, .reads_nodes = true}};

inline constexpr auto bound_kinds = [] {
    std::array<BoundKind, std::size(all_bound_traits)> kinds{};
    for (std::size_t i = 0; i < kinds.size(); ++i) kinds[i] = all_bound_traits[i].kind;
    return kinds;
}();

constexpr const BoundTraits& traits(BoundKind kind) noexcept {
    return all_bound_traits[static_cast<int>(kind)];
}
constexpr std::string_view name(BoundKind kind) noexcept { return traits(kind).name; }
constexpr bool is_exact(BoundKind kind) noexcept { return traits(kind).is_exact; }
constexpr bool can_miss(BoundKind kind) noexcept { return traits(kind).can_miss; }
constexpr bool is_box(BoundKind kind) noexcept { return traits(kind).is_box; }
constexpr bool reads_nodes(BoundKind kind) noexcept { return traits(kind).reads_nodes; }

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

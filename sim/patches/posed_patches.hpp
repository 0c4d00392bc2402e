#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "sim/patches/contact_surface.hpp"

namespace nbd {

/// Sixteen numbers, one for each face or edge of a patch. Loops over them are plain, for the compiler to make
/// vectors of.
struct alignas(64) PatchLanes {
    std::array<float, ContactPatches::width> values;
    float& operator[](std::size_t k) noexcept { return values[k]; }
    float operator[](std::size_t k) const noexcept { return values[k]; }
};
using PatchLanes3 = std::array<PatchLanes, 3>;

/// Where a patch is in a pose, in single precision, relative to an origin that is near, and how it moves.
struct PatchBounds {
    std::array<float, 3> lo, hi;  // box of the faces, and so of the edges
    float longest_edge;           // length of the longest side of a face, metres
    Eigen::Vector3f
        motion_centre;  // of a ball that holds the displacements of its vertices in the step, metres
    float motion_radius;

    /// Squared distance from p to the box.
    float squared_distance_to_box(const std::array<float, 3>& p) const noexcept;
};

/// The faces of a patch, in the pose and with the origin of its bounds. Unused lanes are far from everything.
struct PosedPatch {
    PatchLanes3 centre;                        // centroid of each face
    float radius;                              // of the largest sphere of these that holds its face
    PatchLanes3 corner, side_1, side_2;        // a corner of each face, and its sides from there
    PatchLanes squared_1, squared_2, product;  // of the sides
    PatchLanes inverse_1, inverse_2, inverse_3, inverse;  // 1 / squares of the sides, and of twice the area
    unsigned slivers;  // bit k: face k is too thin to measure in single precision

    /// Distance from p to the nearest of the faces' centroids, metres: no less than to the nearest face, and
    /// at most `radius` more.
    float distance_to_centres(const std::array<float, 3>& p) const noexcept;

    /// Squared distances from p to the faces, metres2, and the least of them. Off by less than 8 tolerances
    /// as distances, but for slivers, for which they are an upper bound.
    float squared_distances(const std::array<float, 3>& p, PatchLanes& squared) const noexcept;
};

/// Sixteen of the edges that a patch owns: from p, along d. As for faces.
struct PosedEdges {
    PatchLanes3 p, d;
    PatchLanes squared, inverse_length;  // of the lengths; 0 for edges without length
    float longest_squared;               // the largest of these
};

/// Two patches, one of each surface.
using PatchPair = LeafPair;

/// Maximum distance that a point of one patch may move relative to a point of the other, metres.
float relative_motion(const PatchBounds& s, const PatchBounds& t) noexcept;
/// Likewise for a point with this displacement and a point of the patch.
float relative_motion(const Eigen::Vector3f& motion, const PatchBounds& t) noexcept;

/// Squared distance of the boxes, metres2.
float squared_distance(const PatchBounds& s, const PatchBounds& t) noexcept;

/// Poses patches of a surface where they are first asked for.
class PosedPatches {
 public:
    /// Begins a pose of the surface, which must stay as it is. origin: metres. v: velocities of its nodes,
    /// [N, 3], not copied. dt: seconds for which they move so.
    void begin(const ContactSurface& surface, const Eigen::Vector3d& origin, const Nodes& v, double dt);

    const ContactSurface& surface() const noexcept { return *surface_; }
    /// Relative to the origin, in single precision.
    std::array<float, 3> position(int vertex) const noexcept;
    /// Displacement in the step of a vertex of a required patch, metres.
    const Eigen::Vector3f& motion(int vertex) const noexcept { return motions_[vertex]; }
    /// Poses the patches pair.*side of all pairs, on the threads of the caller's TBB arena. Their vertices
    /// can then be read by several threads.
    void require(std::span<const PatchPair> pairs, int PatchPair::*side);
    /// Poses the edges of patches that were required, likewise.
    void require_edges(std::span<const PatchPair> pairs, int PatchPair::*side);
    /// A patch that was required, valid until another one is.
    const PosedPatch& operator[](int patch) const noexcept { return posed_[place(patch)]; }
    const PatchBounds& bounds(int patch) const noexcept { return bounds_[place(patch)]; }
    /// Packs of the edges of a patch, which were required; valid until other edges are.
    const PosedEdges* edges(int patch) const noexcept {
        return posed_edges_.data() + edges_at_[place(patch)];
    }
    /// By how much rounding may displace a position of the required patches, metres.
    float tolerance() const noexcept { return tolerance_; }

 private:
    std::size_t place(int patch) const noexcept { return at_[patch]; }
    void list_new(std::span<const PatchPair> pairs, int PatchPair::*side);
    void pose(int patch, PatchBounds& bounds, PosedPatch& posed) const;
    void pose_edges(int patch, PosedEdges* packs) const;

    const ContactSurface* surface_ = nullptr;
    const Nodes* v_ = nullptr;
    double dt_ = 0;
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
    // In the order of required_, of which there may be fewer:
    std::vector<PosedPatch> posed_;
    std::vector<PatchBounds> bounds_;
    std::vector<std::ptrdiff_t> edges_at_;  // first pack in posed_edges_; -1: not required
    std::vector<PosedEdges> posed_edges_;
    std::size_t edge_packs_ = 0;  // in use
    std::vector<int> at_;         // [patches] place in required_; -1: not required
    std::vector<int> required_, new_vertices_, new_edges_;
    float tolerance_ = 0;
    std::uint32_t step_ = 0;
    std::vector<Eigen::Vector3f> motions_;     // [vertices]
    std::vector<std::uint32_t> motion_steps_;  // [vertices] step in which each motion was computed
};

}  // namespace nbd

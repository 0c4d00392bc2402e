#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "collision/geometry/closest_points.hpp"
#include "sim/contact/contact.hpp"
#include "sim/patches/posed_patches.hpp"

namespace nbd {

/// The nearest face of a surface to a point.
struct NearestFace {
    double distance = std::numeric_limits<double>::infinity();  // negative behind the surface, metres
    int face = -1;
    Eigen::Vector3d barycentric, normal;  // of the nearest point; the normal points away from the surface
};

/// Measures the distance of p from a face. reach: metres; at distances far below it the face's own normal
/// gives the direction.
NearestFace measure(const ContactSurface& surface, int face, const Eigen::Vector3d& p, double reach);
/// Likewise from the closest points of p and the face.
NearestFace measure(const ContactSurface& surface, int face, const ClosestPoints& closest, double reach);
/// The closest points of p and a face.
ClosestPoints closest_point(const ContactSurface& surface, int face, const Eigen::Vector3d& p);

/// How far a vertex and a face may approach each other in the step, at most, metres. Their patches must be
/// required.
double approach(const PosedPatches& points, int vertex, const PosedPatches& others, int face,
                const ContactReach& reach);

/// The nearest face in reach, of the patches pair.b, whose normal at its nearest point has the same side as
/// `side`; face is -1 if there is none.
NearestFace nearest_on_side(const PosedPatches& points, int vertex, const PosedPatches& others,
                            std::span<const PatchPair> pairs, const ContactReach& reach,
                            const Eigen::Vector3d& side);

/// Finds the nearest face in reach among those of some patches of a surface, for the vertices of one patch of
/// another after the other. Several threads may search the same patches, each with its own object.
class NearestFaceSearch {
 public:
    /// All patches that are searched must be required.
    NearestFaceSearch(const PosedPatches& points, const PosedPatches& others, const ContactReach& reach)
        : points_(points),
          others_(others),
          reach_(reach),
          slack_(16 * (points.tolerance() + others.tolerance())) {}

    /// Begins the search for the vertices of a patch. pairs: this patch, and those of the faces; at least
    /// one.
    void begin_patch(std::span<const PatchPair> pairs);

    /// The nearest face of a vertex, -1 if none is in reach; of several as near, the first.
    int nearest(int vertex);

    /// Faces whose distance from a vertex was measured in double precision.
    long measured() const noexcept { return measured_; }

 private:
    /// A patch that may have the nearest face of a vertex: how near it is at least, and the maximum reach of
    /// its faces.
    struct NearPatch {
        float distance, reach;
        int patch;
    };
    /// A face and the squared distance to it in single precision.
    struct Candidate {
        float squared;
        int face;
    };
    /// Of a distance, with what rounding may add.
    float squared(float distance) const noexcept { return (distance + slack_) * (distance + slack_); }
    bool in_reach(int vertex, int face, double distance) const;
    void visit(const NearPatch& near, int vertex, const std::array<float, 3>& q);
    int nearest_candidate(int vertex);

    const PosedPatches &points_, &others_;
    const ContactReach& reach_;
    float slack_, most_ = 0;         // most_: the nearest face in reach is no farther
    std::vector<NearPatch> of_all_;  // for all vertices of the patch, the nearest first
    std::vector<NearPatch> near_;    // for one
    PatchLanes squared_;
    std::vector<Candidate> candidates_;
    long measured_ = 0;
};

/// A vertex whose nearest face is sought, and the place of its patch's pairs in a list.
struct SoughtVertex {
    int vertex;
    std::size_t group;
};

struct NearestFaces {
    std::vector<int> of_vertices;  // -1: none is in reach
    long measured = 0;             // see NearestFaceSearch::measured()
};

/// The nearest face of each vertex, see NearestFaceSearch::nearest(), on the threads of the caller's TBB
/// arena. groups: for each patch its pairs with patches of `others`. sought: by ascending group.
NearestFaces nearest_faces(const PosedPatches& points, const PosedPatches& others,
                           std::span<const std::span<const PatchPair>> groups, const ContactReach& reach,
                           std::span<const SoughtVertex> sought);

}  // namespace nbd

#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "collision/continuous/surface_features.hpp"
#include "collision/geometry/tet_mesh.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"

namespace nbd {

/// A body meets others and itself; obstacles meet bodies, and neither each other nor themselves.
enum class BodyRole { body, obstacle };

/// A surface whose vertices move straight from one pose to another, or stay in a pose, for FeatureQuery.
/// Positions are double precision, in any unit of length and any distance from the origin. The surface may be
/// open, and any number of faces may share an edge; vertices without faces are ignored.
class MovingBody {
 public:
    /// X: positions in any pose, [n, 3]; by them faces are sorted into a tree. It is the body's pose until
    /// move(). F: [m, 3]. Throws std::invalid_argument for no faces, a vertex that does not exist or a
    /// position that is not finite.
    MovingBody(NodesRef X, FacesRef F, BodyRole role = BodyRole::body);

    /// Starts a step from one pose to another; copied. Throws std::invalid_argument, and changes nothing,
    /// unless both are [n, 3] and finite.
    void move(NodesRef begin, NodesRef end);
    /// The body stays here.
    void pose(NodesRef x) { move(x, x); }

    /// Positions after a share of the step, [n, 3]; those of its end for 1.
    Nodes at(double share) const { return share == 1 ? end_ : Nodes(begin_ + share * (end_ - begin_)); }

    bool is_obstacle() const noexcept { return role_ == BodyRole::obstacle; }
    const Faces& F() const noexcept { return F_; }
    const SurfaceFeatures& features() const noexcept { return features_; }
    NumberedSurface numbered(int surface) const noexcept { return {surface, F_, features_}; }
    const Nodes& begin() const noexcept { return begin_; }
    const Nodes& end() const noexcept { return end_; }

 private:
    friend class FeatureQuery;

    /// The step as a query sees it: relative to an origin, times a scale that brings it near 1, and less the
    /// motion of the frame, which is linear in time.
    struct Local {
        Nodes begin, end;
        Vertices begin_float, end_float;
        double rounding = 0;  // of a coordinate in float
    };
    void make_local(Local& local, const Eigen::RowVector3d& origin, double scale, bool with_motion) const;

    BodyRole role_;
    Faces F_;
    SurfaceFeatures features_;
    std::vector<FeaturePair> neighbours_;  // see neighbour_features(); of no obstacle
    Nodes begin_, end_;
    PosedTree tree_, own_tree_;
    Local local_, own_;
};

/// The corners of a pair: the vertex and the corners of the face, or the ends of edge a and of edge b. a, b:
/// the bodies of the pair.
inline std::array<int, 4> feature_vertices(const FeaturePair& pair, const MovingBody& a,
                                           const MovingBody& b) noexcept {
    return feature_vertices(pair, a.numbered(pair.surface_a), b.numbered(pair.surface_b));
}

/// How much of a step is free of collisions.
struct FreeStep {
    double share = 1;                  // of the step, in [0, 1]
    std::optional<FeaturePair> limit;  // the pair that ends it; none if all of the step is free
    double gap = 0;                    // distance of that pair at the begin of the step
    bool exhausted = false;            // its search ran out of iterations: it may not collide, see Impact
};

/// Which features of bodies may meet in a step, and how much of the step they may take. Surfaces are numbered
/// as they stand in the list of bodies.
///
/// Owns its scratch memory, which only grows. Results stay valid until the next call on the same object. Use
/// one object per thread; it writes into the bodies.
class FeatureQuery {
 public:
    /// Pairs of a vertex and a face, and of two edges, whose boxes over the whole step come within
    /// `distance`: none that does so itself at any time of the step is left out. They have no vertex in
    /// common; pairs of one body, relative to its mean motion, are found between all of its faces, also those
    /// that share a vertex. Sorted, without repeats; of two edges of one body the smaller stands first.
    /// distance: finite, >= 0, in the unit of the positions; boxes farther apart by 2e-15 of the size of
    /// the whole are taken for near, too.
    /// Throws std::invalid_argument on a distance out of range.
    std::span<const FeaturePair> candidates(std::span<MovingBody> bodies, double distance);

    /// The share of the step up to which all features of candidates() stay farther apart than `separation`,
    /// and those that would come nearer later in the step keep a share `left` of what their distance at the
    /// begin has above it. A pair that is not farther apart than `separation` at the begin ends the step at
    /// share 0, wherever it moves.
    /// separation: finite, >= 0; left: 0 <= left < 1. Throws std::invalid_argument if out of range.
    FreeStep collision_free_step(std::span<MovingBody> bodies, double separation, double left = 0.1);

 private:
    void find(std::span<MovingBody> bodies, int body, double distance);
    void find(std::span<MovingBody> bodies, int a, int b, double distance);
    void keep_near(std::size_t first, const MovingBody& s, const MovingBody::Local& local_s,
                   const MovingBody& t, const MovingBody::Local& local_t, double distance);

    PairQuery pair_query_;
    SelfQuery self_query_;
    std::vector<FeaturePair> pairs_;
};

}  // namespace nbd

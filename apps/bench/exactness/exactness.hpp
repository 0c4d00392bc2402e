#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "apps/bench/measure/rows.hpp"
#include "apps/bench/pairs/bench_body.hpp"
#include "collision/base/counter_random.hpp"
#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Poses that every exact bound must survive.
enum class WildPose { twisted, crushed, inverted, scattered, far };

inline constexpr WildPose wild_poses[] = {WildPose::twisted, WildPose::crushed, WildPose::inverted,
                                          WildPose::scattered, WildPose::far};

const char* name(WildPose pose) noexcept;

/// Nodes of two bodies, [N, 3] each.
struct WildScene {
    Vertices a, b;
};

/// Draws two bodies in such poses, each with axis, amplitude and orientation of its own: twisted by up to
/// three turns; crushed to between a tenth and a hundred-thousandth along an axis; folded over a plane
/// through the body, so that what lies behind it is inside out; every node moved by up to a tenth of the
/// radius; or turned, with both bodies 1,000 to 100,000 radii away from the origin. overlap, in (0, 1): the
/// second body is placed so that the bodies' boxes overlap by this share of their extents on at least one
/// axis. nodes: at rest, not all in one place.
WildScene draw_wild_scene(const Vertices& nodes, WildPose pose, double overlap, CounterRandom random);

/// All pairs of faces of two surfaces that intersect (distance 0) or lie within a distance, metres, sorted by
/// (a, b). The reference that queries are checked against: it shares nothing with them but the test of two
/// triangles. Compares the boxes of all faces, along one axis after sorting, and asks the triangles of each
/// pair of boxes. xa, xb: positions [n, 3]; fa, fb: faces.
std::vector<FacePair> swept_pairs(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb, float distance);

struct ExactnessConfig {
    int scenes = 100;  // of each body, divided among the kinds of wild poses
    std::uint64_t seed = 1;
};

/// Asks for intersecting faces, and in every fourth scene for those within a distance, with all exact bounds,
/// mixed pairs of them included, and all kernels of this machine; compares the sets with swept_pairs(). The
/// bodies' boxes overlap more and more until faces intersect. Returns a row for each kind of wild poses:
/// body, faces (of each body), poses, scenes, touching (scenes whose reference is not empty), pairs (in the
/// references), queries (answers compared), different (answers that differ), and first_difference (which
/// bounds and kernels, in which scene). called: the body's name in the rows. body: its surface must hang on
/// its nodes with weights >= 0. done: called after each scene with the number of scenes so far; may throw.
Rows check_exactness(const std::string& called, const BenchBody& body, const ExactnessConfig& config,
                     const std::function<void(int)>& done);

}  // namespace nbd

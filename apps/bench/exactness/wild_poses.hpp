#pragma once

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

}  // namespace nbd

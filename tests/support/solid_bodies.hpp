#pragma once

#include <vector>

#include "collision/bounds/certified/solid_graph.hpp"
#include "meshing/body/body.hpp"

namespace nbd::test {

/// Tetrahedra and a surface embedded in them.
struct SolidBody {
    TetMesh solid;
    SurfaceWeights W;
    Vertices X;  // [n, 3]
    Faces F;

    /// Surface positions of a pose, summed in float32.
    Vertices surface(const Vertices& nodes) const;
};

SolidBody solid_body(const Body& body);

TetMesh solid_box_mesh();

/// A box with the boundary of its tetrahedra as surface.
SolidBody solid_box();

/// A box with a slot: straight segments between its arms leave the body.
SolidBody solid_fork();

/// Two separate boxes.
SolidBody solid_pair();

/// A ball partly inside and partly outside the box in which it is embedded, so weights interpolate and
/// extrapolate.
SolidBody solid_ball();

/// Every kind of embedded surface.
std::vector<SolidBody> solid_bodies();

constexpr int pose_kinds = 10;

/// Node positions of pose `number`, [N, 3]. Cycles through kinds of poses from rigid to extreme.
Vertices solid_pose(const SolidBody& body, int number);

}  // namespace nbd::test

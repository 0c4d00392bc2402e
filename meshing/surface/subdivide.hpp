#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// midpoint: new vertices halfway along edges, the shape stays. loop: new and old vertices are averaged so
/// that repeated steps tend to a smooth surface, which shrinks a little [Loop87].
enum class SubdivisionScheme { midpoint, loop };

/// A finer surface and the matrix that carries the coarse one's vertices to it: mesh.X = S coarse.X, so that
/// S W embeds the fine surface where W embeds the coarse one.
struct Subdivision {
    TriMesh mesh;
    Embedding S;  // [fine vertices, coarse vertices], rows sum to 1
};

/// Cuts every face into four, `levels` times, 0 to 4. Face f becomes faces 4 f (at its first corner) to
/// 4 f + 3 (in the middle), of its orientation; old vertices keep their numbers.
/// Throws std::invalid_argument on other levels and on a mesh that check_surface() refuses.
Subdivision subdivide(const TriMesh& coarse, SubdivisionScheme scheme, int levels);

}  // namespace nbd

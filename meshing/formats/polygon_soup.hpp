#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Unchecked content of a surface file: positions and polygons, face by face.
struct PolygonSoup {
    std::vector<std::array<double, 3>> X;
    std::vector<std::int64_t> corners;  // rows of X
    std::vector<std::size_t> face_end;  // for each face, one past its last corner
    std::size_t face_count() const noexcept { return face_end.size(); }
};

/// Triangles in the order of the faces. Skips faces with fewer than three corners. Throws std::runtime_error,
/// naming the face or vertex, for an index out of range, a coordinate that no float32 can hold, no faces at
/// all, or more than 2^31 - 1 vertices or face corners.
TriMesh triangulate(const PolygonSoup& soup);

}  // namespace nbd

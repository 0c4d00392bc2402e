#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// What a surface file holds before it is checked: positions and polygons, face after face.
struct PolygonSoup {
    std::vector<std::array<float, 3>> X;
    std::vector<std::int64_t> corners;  // rows of X
    std::vector<std::size_t> face_end;  // past each face's last corner
    std::size_t face_count() const noexcept { return face_end.size(); }
};

/// Triangles in the faces' order. Faces with fewer than three corners are left out.
/// Throws std::runtime_error naming the face or vertex on an index out of range, a coordinate that is not
/// finite, no face at all, or more than 2^31 - 1 vertices or triangles.
TriMesh triangulate(const PolygonSoup& soup);

}  // namespace nbd

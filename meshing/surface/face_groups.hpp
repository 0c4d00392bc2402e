#pragma once

#include <string>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Faces of a surface that a file gives a name.
struct FaceGroup {
    std::string name;
    std::vector<int> faces;  // rows, ascending
    bool operator==(const FaceGroup&) const = default;
};

/// Throws std::invalid_argument, naming the first group, for a name that is empty or of two, and for faces
/// that do not ascend or are not in 0 .. faces - 1.
void check_face_groups(const std::vector<FaceGroup>& groups, int faces);

/// Groups of `to` that lie where those of `from` do: a face is in a group where the face of `from` that is
/// nearest to its centre is. groups: of `from`. Those that get no face are left out.
std::vector<FaceGroup> groups_on(const TriMesh& to, const TriMesh& from,
                                 const std::vector<FaceGroup>& groups);

}  // namespace nbd

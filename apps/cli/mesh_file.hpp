#pragma once

#include <filesystem>

#include "apps/cli/output.hpp"
#include "meshing/body/body.hpp"
#include "meshing/surface/subdivide.hpp"
#include "meshing/tets/tetrahedralize.hpp"

namespace nbd {

struct MeshFileConfig {
    TetrahedralizeConfig tets;  // of a surface
    Material material;
    int levels = 0;  // of subdivision
    SubdivisionScheme scheme = SubdivisionScheme::midpoint;
};

/// A body from a file: a surface, which is checked and filled with tetrahedra, or tetrahedra made elsewhere
/// (.msh .vtk .mesh), whose boundary is the surface. Says on `out` what was found and repaired. Throws what
/// reading, checking and filling throw; messages of checks are led by the path.
Body mesh_file(const std::filesystem::path& path, const MeshFileConfig& config, const Output& out);

/// The same where it is known which of both the file holds.
Body body_of_surface(const std::filesystem::path& path, const MeshFileConfig& config, const Output& out);
Body body_of_tets(const std::filesystem::path& path, const MeshFileConfig& config, const Output& out);

}  // namespace nbd

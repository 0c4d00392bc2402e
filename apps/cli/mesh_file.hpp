#pragma once

#include <filesystem>

#include "apps/cli/output.hpp"
#include "meshing/body/body.hpp"
#include "meshing/surface/subdivide.hpp"
#include "meshing/tets/tetrahedralize.hpp"

namespace nbd {

struct MeshFileConfig {
    TetrahedralizeConfig tets;  // for surfaces
    Material material;
    int levels = 0;  // subdivision levels
    SubdivisionScheme scheme = SubdivisionScheme::midpoint;
};

/// Makes a body from a file. A surface is checked and filled with tetrahedra; for tetrahedra made elsewhere
/// (.msh .vtk .mesh), the surface is their boundary. Prints to `out` what was found and repaired. Throws what
/// reading, checking and filling throw; messages of checks start with the path.
Body mesh_file(const std::filesystem::path& path, const MeshFileConfig& config, const Output& out);

/// As mesh_file(), for a file known to hold a surface or tetrahedra.
Body body_of_surface(const std::filesystem::path& path, const MeshFileConfig& config, const Output& out);
Body body_of_tets(const std::filesystem::path& path, const MeshFileConfig& config, const Output& out);

}  // namespace nbd

#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "apps/cli/output.hpp"
#include "meshing/body/body.hpp"
#include "meshing/cage/cage_body.hpp"
#include "meshing/tets/tetrahedralize.hpp"
#include "sim/scene/scene.hpp"

namespace nbd {

/// How a file becomes a body: as in scenes, where `tets` and `weld` are for surfaces, and more.
struct MeshFileConfig : SceneMeshing {
    int cage = 0;          // for surfaces: tet nodes of a cage around any triangle soup; 0: no cage
    std::string inside{};  // for surfaces: body file in whose tetrahedra they lie; empty: none
    Material material{};
    // For files with groups of tetrahedra: what changes the material in these, by name.
    std::map<std::string, MaterialChange> regions{};
};

struct MeshedFile {
    Body body;
    TetOptimization optimization;    // of tetrahedra made here
    std::optional<CageReport> cage;  // of a body in a cage
    TriMesh solid{};  // that fills its tetrahedra in part; empty: they are full, or it is not known

    const TriMesh* solid_in_tets() const noexcept { return solid.F.rows() > 0 ? &solid : nullptr; }
};

/// Makes a body from a file. A surface is checked and filled with tetrahedra; for tetrahedra made elsewhere
/// (.msh .mesh .vtk .vtu .inp), or those of a body file (.h5) with its material, the surface is their
/// boundary. With `cage` or `inside`, any surface is taken as it is and embedded in the tetrahedra of a
/// coarse cage around it, or in those of another body, whose materials it takes. Else, unless
/// error_to_search_for() is 0, the edges of quadratic tetrahedra become shorter until they bend as rightly.
/// Groups of tetrahedra in the file become regions of material. Prints to `out` what was found and repaired.
/// Positions far from zero are counted from an origin of the body, see Body::origin. Throws
/// std::runtime_error, before it takes memory, if the surface needs more than is available; and what reading,
/// checking and filling throw; messages of checks start with the path. Throws std::invalid_argument if
/// `regions` names a group that the file does not have.
MeshedFile mesh_file(const std::filesystem::path& path, const MeshFileConfig& config, const Output& out);

/// Whether a file holds tetrahedra, by its extension: .msh .mesh .vtk .vtu .inp, or .h5 for a body.
bool holds_tets(const std::filesystem::path& path);

/// As mesh_file(), for a file known to hold a surface, or tetrahedra.
MeshedFile body_of_surface(const std::filesystem::path& path, const MeshFileConfig& config,
                           const Output& out);
Body body_of_tets(const std::filesystem::path& path, const MeshFileConfig& config, const Output& out);

}  // namespace nbd

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "meshing/surface/face_groups.hpp"

namespace nbd {

/// Tetrahedra that a file puts together: a physical group of gmsh, a reference number of Medit, a number in
/// the cell data of VTK, a set of CalculiX.
struct TetGroup {
    std::string name;       // "group 7" where the file gives a number alone
    std::vector<int> tets;  // ascending
};

/// Reads tetrahedra made by other programs: gmsh .msh (2.x and 4.1, text or binary), Medit .mesh (text),
/// VTK .vtk (legacy, text or binary) and .vtu, CalculiX .inp (4-node tetrahedra). The result is finite, every
/// tetrahedron has positive volume (negative ones are flipped), a face has at most two tetrahedra, and every
/// node belongs to a tetrahedron (others are dropped; the rest keep their order). Points, lines and surface
/// cells in the file are skipped; other volume cells are an error. notes: if given, receives one line for
/// each kind of repair or omission. groups: if given, receives the groups in the order of their names, unless
/// all tetrahedra are in a single one without a name. Number 0 is no group. A volume in several physical
/// groups or sets counts for its first. Groups of partitioned .msh 4.1 files are not read. face_groups: if
/// given, receives groups of rows of boundary_faces() likewise, of physical surfaces of gmsh, of references
/// of Medit's triangles, which stand behind the vertices there, of triangles with a number in VTK, and of
/// surfaces, sets of triangles and of nodes in CalculiX: of these the faces whose corners are all in the set.
/// Throws a one-line std::runtime_error (path, place, reason) for anything else, including truncated files.
TetMesh read_tets(const std::filesystem::path& path, std::vector<std::string>* notes = nullptr,
                  std::vector<TetGroup>* groups = nullptr, std::vector<FaceGroup>* face_groups = nullptr);

}  // namespace nbd

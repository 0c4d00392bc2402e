#pragma once

#include <string>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// What keeps a triangle soup from bounding a solid, and what clean_soup() dropped of it. A face may count in
/// several lines. Edges and shells are those of the faces that repeat no vertex.
struct SoupReport {
    int vertices = 0, faces = 0;
    int repeating_faces = 0;   // faces that repeat a vertex, which were dropped
    int flat_faces = 0;        // other faces without area
    int duplicate_faces = 0;   // faces with the vertices of an earlier face
    int open_edges = 0;        // edges of one face
    int crowded_edges = 0;     // edges of more than two faces
    int shells = 0;            // parts that share no edge
    int dropped_vertices = 0;  // vertices that no kept face uses
};

/// One line: counts, then the defects that there are.
std::string describe(const SoupReport& report);

/// Drops the faces that repeat a vertex and the vertices without a face. All others stay as they are, in
/// their order. Throws std::invalid_argument for an index out of range, a non-finite vertex, and a soup
/// without faces or extent.
SoupReport clean_soup(TriMesh& soup);

}  // namespace nbd

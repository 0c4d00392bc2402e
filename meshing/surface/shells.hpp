#pragma once

#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// A closed part of a surface: faces connected by edges, each of which has two faces.
struct Shell {
    std::vector<int> faces;  // ascending
    double volume = 0;  // m3 that it encloses; negative where its faces look inward, as those of a cavity do
};

/// The parts of a surface, by their first faces. Open parts, and those with edges of more than two faces, are
/// left out. F: of X, indices in range.
std::vector<Shell> shells_of(NodesRef X, FacesRef F);

/// The parts of a surface that bound its cavities: those whose faces look inward, where others look outward.
/// None in a surface with a face that repeats a vertex.
std::vector<Shell> cavities_of(NodesRef X, FacesRef F);

/// Some faces as a surface of their own, whose vertices keep their order. vertices: out, if not null, the row
/// of each in X.
TriMesh part_of(NodesRef X, FacesRef F, const std::vector<int>& faces, std::vector<int>* vertices = nullptr);

}  // namespace nbd

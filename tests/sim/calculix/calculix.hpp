#pragma once

#include <string>
#include <vector>

#include "meshing/body/body.hpp"

namespace nbd::test {

/// Whether the independent FEM program `ccx` (Debian: calculix-ccx) is available. Its elements C3D4 and
/// C3D10 are the linear and the quadratic tetrahedron.
bool calculix_installed();

/// One quantity of a body, computed by us and by CalculiX on the same tetrahedra.
struct Comparison {
    std::string quantity;
    double ours = 0, theirs = 0;
    double difference = 0;  // relative
    int nodes = 0;          // of the body, where the caller does not know it
};

/// The lowest elastic frequencies of the free body, Hz.
std::vector<Comparison> compare_frequencies(const Body& body, int count = 20);

/// Small displacements of the body clamped at one end of its longest side, in metres: under its weight across
/// that side, and pulled at the node farthest from the clamp. Compares the largest node displacement; the
/// difference is the largest over all nodes, relative to it.
std::vector<Comparison> compare_deflections(const Body& body);

/// The same clamp under a weight that bends the body by about `share` of its length. CalculiX's Green strains
/// are the law of St. Venant and Kirchhoff; the corotated law is another one at large strains.
Comparison compare_large_deflection(const Body& body, MaterialLaw law, double share = 0.2);

/// Large displacements of quadratic bodies of that law by the static increments of a world, which CalculiX
/// finds by its own: a cantilever and a plate under their weight, a block pressed between bonded plates.
std::vector<Comparison> compare_static_increments();

}  // namespace nbd::test

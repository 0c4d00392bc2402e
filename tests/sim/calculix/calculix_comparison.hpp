#pragma once

#include <string>
#include <vector>

#include "meshing/body/body.hpp"

namespace nbd::test {

/// One quantity of a body as we and CalculiX find it on the same tetrahedra.
struct Comparison {
    std::string quantity;
    double ours = 0, theirs = 0;
    double difference = 0;  // relative
};

/// The lowest elastic frequencies of the free body with either kind of mass, Hz.
std::vector<Comparison> compare_frequencies(const Body& body, int count = 20);

/// The body clamped at one end of its longest side, small displacements: under its weight across that side,
/// and pulled at the node farthest from the clamp. Largest displacement of a node, metres; the difference is
/// the largest of any node over that.
std::vector<Comparison> compare_deflections(const Body& body);

/// The same clamp under a weight that bends the body by about `share` of its length: our corotated
/// equilibrium against CalculiX's Green strains, which are different materials where strains are not small.
Comparison compare_large_deflection(const Body& body, double share = 0.2);

}  // namespace nbd::test

#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim/fem/elastic_body.hpp"

namespace nbd::test {

/// Whether the program `ccx` (Debian: calculix-ccx) can be run: an independent FEM program, whose element
/// C3D4 is the linear tetrahedron.
bool calculix_installed();

/// Frequencies of the free body without the six rigid modes, the lowest `count`, Hz, ascending.
/// The mass matrices are equal: a C3D4 element's own is integrated at one point, 1/16 of its mass in each
/// entry, so point masses on the nodes make up the difference to the body's kind.
/// This and the next: throws std::runtime_error with CalculiX's first error message.
Eigen::VectorXd calculix_frequencies(const ElasticBody& body, MassKind mass, int count);

/// A body that is held and loaded.
struct StaticCase {
    std::vector<int> held;                              // nodes that do not move
    Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // m/s2
    int pulled = 0;                                     // the node that `pull` acts on
    Eigen::Vector3d pull = Eigen::Vector3d::Zero();     // newtons
};

/// Displacements of the nodes at rest under the loads, [N, 3], metres. `large`: with its Green strains for
/// large displacements (NLGEOM) instead of the linear ones.
Nodes calculix_displacements(const ElasticBody& body, const StaticCase& load, bool large = false);

}  // namespace nbd::test

#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim/fem/elastic_body.hpp"

namespace nbd::test {

/// Whether the independent FEM program `ccx` (Debian: calculix-ccx) is available. Its element C3D4 is the
/// linear tetrahedron.
bool calculix_installed();

/// The lowest `count` elastic frequencies of the free body (no rigid modes), Hz, ascending. C3D4 integrates
/// its mass at one point (1/16 of it in each entry), so point masses on the nodes supply the difference from
/// the body's kind of mass. Throws std::runtime_error with CalculiX's first error message; so does
/// calculix_displacements.
Eigen::VectorXd calculix_frequencies(const ElasticBody& body, MassKind mass, int count);

/// A body with fixed nodes and loads.
struct StaticCase {
    std::vector<int> held;                              // fixed nodes
    Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // m/s2
    int pulled = 0;                                     // node that `pull` acts on
    Eigen::Vector3d pull = Eigen::Vector3d::Zero();     // newtons
};

/// Static displacements of the nodes under the loads, [N, 3], metres. `large`: uses Green strains for large
/// displacements (NLGEOM) instead of linear strains.
Nodes calculix_displacements(const ElasticBody& body, const StaticCase& load, bool large = false);

}  // namespace nbd::test

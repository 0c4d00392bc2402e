#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Poisson's ratios that a body may have: at -1 and 0.5 a linear material is infinitely stiff, and close to
/// them eigensolvers and tetrahedra of four nodes lock.
constexpr double least_poisson = -0.999, max_poisson = 0.499;

/// Linear elastic material.
struct Material {
    double young = 1e5;                // Pa, > 0
    double poisson = 0.40;             // least_poisson to max_poisson
    double density = 1000;             // kg/m3, > 0
    double rayleigh_mass = 0.1;        // 1/s, >= 0
    double rayleigh_stiffness = 1e-3;  // s, >= 0
};

/// Linear vibration modes of the free body without its six rigid ones. Empty until computed.
struct ModeBasis {
    Eigen::MatrixXf U;            // [3 N, m], node-major (x y z of node 0 first), columns M-orthonormal
    Eigen::VectorXd frequencies;  // [m], Hz, ascending
    int count() const noexcept { return static_cast<int>(U.cols()); }
};

/// A deformable body at rest: what `nbdtree mesh` writes and everything else starts from.
struct Body {
    std::string name;
    TetMesh tets;
    TriMesh surface;  // the collision surface; surface.X = W tets.X up to rounding
    Embedding W;      // [surface vertices, tet nodes]
    Material material;
    ModeBasis modes;
};

/// Hex SHA-256 over tets, surface and embedding (not material or modes): what recordings and trees of this
/// body carry, so that a file of another body is refused.
std::string body_hash(const Body& body);

/// Writes atomically. Throws std::runtime_error with path and reason.
void save_body(const std::filesystem::path& path, const Body& body);

/// Throws std::runtime_error on a missing, truncated, damaged or foreign file, or one whose content is
/// inconsistent (index out of range, wrong shapes, non-positive volume, non-finite number).
Body load_body(const std::filesystem::path& path);

}  // namespace nbd

#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Allowed range of Poisson's ratio. At -1 and 0.5 a linear material is infinitely stiff; close to them
/// eigensolvers fail and four-node tetrahedra lock.
constexpr double least_poisson = -0.999, max_poisson = 0.499;

/// Linear elastic material.
struct Material {
    double young = 1e5;                // Pa, > 0
    double poisson = 0.40;             // least_poisson to max_poisson
    double density = 1000;             // kg/m3, > 0
    double rayleigh_mass = 0.1;        // 1/s, >= 0
    double rayleigh_stiffness = 1e-3;  // s, >= 0
    bool operator==(const Material&) const = default;
};

/// Linear vibration modes of the free body, without the six rigid ones. Empty until computed.
struct ModeBasis {
    Eigen::MatrixXf U;            // [3 N, m], node-major (x y z of node 0 first), columns M-orthonormal
    Eigen::VectorXd frequencies;  // [m], Hz, ascending
    int count() const noexcept { return static_cast<int>(U.cols()); }
};

/// A deformable body at rest. `nbdtree mesh` writes it; every other command starts from it.
struct Body {
    std::string name;
    TetMesh tets;
    TriMesh surface;  // the collision surface; surface.X = W tets.X up to rounding
    Embedding W;      // [surface vertices, tet nodes]
    Material material;
    ModeBasis modes;
};

/// Hex SHA-256 over tets, surface and embedding (not material or modes). Recordings and trees store it, so
/// that a file of another body is rejected.
std::string body_hash(const Body& body);

/// Writes the file atomically. Throws std::runtime_error with path and reason.
void save_body(const std::filesystem::path& path, const Body& body);

/// Throws std::runtime_error for a missing, truncated, damaged or foreign file, or inconsistent content
/// (index out of range, wrong shapes, non-positive volume, non-finite number).
Body load_body(const std::filesystem::path& path);

}  // namespace nbd

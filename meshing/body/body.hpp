#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "meshing/body/material.hpp"
#include "meshing/surface/face_groups.hpp"
#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Linear vibration modes of the free body, without the six rigid ones. Empty until computed.
struct ModeBasis {
    Eigen::MatrixXf U;            // [3 N, m], node-major (x y z of node 0 first), columns M-orthonormal
    Eigen::VectorXd frequencies;  // [m], Hz, ascending
    int count() const noexcept { return U.cols(); }
};

/// A deformable body at rest. `nbdtree mesh` writes it; every other command starts from it.
struct Body {
    std::string name;
    // Where the zero of all its positions lies, metres. Zero unless the body lies so far away that float32
    // would be too coarse for its shape, see far_origin().
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    TetMesh tets;
    TriMesh surface;  // the collision surface; surface.X = W tets.X up to rounding
    Embedding W;      // [surface vertices, tet nodes]
    Material material;
    std::vector<MaterialRegion> regions{};  // distinct tetrahedra and names; all others are of `material`
    std::vector<FaceGroup> face_groups{};   // of the surface, with distinct names; a face may be in several
    ModeBasis modes;
    // By how much it bends too little, as nbd::bending_error() estimated; empty: not known.
    std::optional<double> bending_error{};

    /// W in single precision, as bounds and recordings take it.
    SurfaceEmbedding float_weights() const { return W.cast<float>(); }
};

/// The body's material with Young's modulus and density in the mean over its volume.
Material mean_material(const Body& body);

/// Hex SHA-256 over tets, surface, embedding and an origin that is not zero (not materials or modes).
/// Recordings and trees store it, so that a file of another body is rejected.
std::string body_hash(const Body& body);

/// Writes the file atomically. Throws std::runtime_error with path and reason.
void save_body(const std::filesystem::path& path, const Body& body);

/// Throws std::runtime_error for a missing, truncated, damaged or foreign file, or inconsistent content
/// (index out of range, wrong shapes, non-positive volume, non-finite number).
Body load_body(const std::filesystem::path& path);

/// Throws std::invalid_argument naming the first error: an empty mesh, an index out of range, a non-finite
/// number, a tetrahedron without positive volume, inconsistent shapes, weights that do not sum to 1 or do not
/// reproduce the surface, a material or region out of range, or modes that do not fit the nodes.
void check_body(const Body& body);

}  // namespace nbd

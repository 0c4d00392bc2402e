#pragma once

#include "sim/fem/elastic_body.hpp"

namespace nbd {

/// Textbook assembly, for comparison: tetrahedron by tetrahedron, with the rotation from Eigen's Jacobi SVD
/// and the 12x12 element matrix R K_e R^T, whose blocks are added one by one to the sparse matrix. K_e and
/// the pattern are computed once.
class TextbookAssembly {
 public:
    explicit TextbookAssembly(const ElasticBody& body);

    /// force: elastic forces on the nodes, [N, 3]. A: mass_scale M + stiffness_scale K, in the body's
    /// pattern.
    void assemble(const Nodes& x, double mass_scale, double stiffness_scale, Nodes& force, SparseMatrix& A);

 private:
    const ElasticBody& body_;
    SparseMatrix mass_;
    std::vector<Eigen::Matrix3d> inverse_edges_;
    std::vector<Eigen::Matrix<double, 12, 12>> stiffness_;  // K_e
};

}  // namespace nbd

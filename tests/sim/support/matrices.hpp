#pragma once

#include "sim/fem/elastic_body.hpp"

namespace nbd::test {

/// A matrix that came from body.zero_matrix(), in double precision.
inline SparseMatrix sparse(const ElasticBody& body, const StepMatrix& A) {
    const BlockPattern& pattern = body.pattern();
    SparseMatrix result = pattern.zero_matrix();
    for (int i = 0; i < body.node_count(); ++i)
        for (int k = 0; k < std::ssize(pattern.neighbours(i)); ++k)
            pattern.block(result, i, k) = A.block(i, k).transpose();
    return result;
}

/// mass_scale M + stiffness_scale (K + damping D)(pose).
inline SparseMatrix combined(const ElasticBody& body, double mass_scale, double stiffness_scale,
                             const ElementPose& pose) {
    StepMatrix A = body.zero_matrix();
    body.combine(mass_scale, stiffness_scale, pose, A);
    return sparse(body, A);
}

/// The product of (K + damping D)(pose) with velocities u, without a matrix.
inline Nodes tangent_product(const ElasticBody& body, const ElementPose& pose, const Nodes& u) {
    ElementForces scratch;
    Nodes result(u.rows(), 3);
    body.tangent_product(pose, u, scratch, result);
    return result;
}

}  // namespace nbd::test

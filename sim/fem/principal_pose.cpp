// The passes of ElasticBody over the elements of a pose, for laws that are functions of the principal
// stretches.
#include "sim/fem/elastic_body.hpp"

namespace nbd {
namespace {

/// U diag(stress) V^T.
LaneMatrix3 turned_back(const PrincipalStretches& stretches, const PrincipalLanes& stress) noexcept {
    const auto& [U, V, sigma] = stretches;
    LaneMatrix3 P;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            P(i, j) =
                stress[0] * U(i, 0) * V(j, 0) + stress[1] * U(i, 1) * V(j, 1) + stress[2] * U(i, 2) * V(j, 2);
    return P;
}

}  // namespace

LaneModuli ElasticBody::lane_moduli(int batch) const {
    LaneModuli result;
    for (int l = 0; l < lanes; ++l) {
        const auto& [law, mu, lambda] = moduli(first_tet(batch) + std::min(l, tets_of(batch) - 1));
        result.law[l] = law;
        result.mu[l] = mu;
        result.lambda[l] = lambda;
    }
    return result;
}

PrincipalLanes ElasticBody::principal_stretches_of(NodesRef x, int batch) const {
    LaneMatrix3 F, R;
    gradients(x, batch, F);
    rotations_of(F, R);
    return principal_stretches(F, R).sigma;
}

void ElasticBody::stress_of(NodesRef x, int batch, LaneMatrix3& F, LaneMatrix3& P) const {
    LaneMatrix3 R;
    gradients(x, batch, F);
    rotations_of(F, R);
    const PrincipalStretches stretches = principal_stretches(F, R);
    P = turned_back(stretches, respond(lane_moduli(batch), stretches.sigma).stress);
}

void ElasticBody::principal_batch(NodesRef x, int batch, const StepMotion* motion, ElementPose& pose,
                                  ElementForces& forces, Tangent tangent) const {
    const Lanes volume = volumes(batch);
    const LaneModuli moduli = lane_moduli(batch);
    LaneMatrix3 F, P;
    gradients(x, batch, F);
    LaneMatrix3& R = pose.R[batch];
    rotations_of(F, R);
    const PrincipalStretches stretches = principal_stretches(F, R);
    PrincipalResponse response = respond(moduli, stretches.sigma);
    P = turned_back(stretches, response.stress);
    for (Lanes& entry : P.entries) entry *= -volume;
    response.project();
    if (tangent == Tangent::rotated)
        for (int l = 0; l < lanes; ++l)
            if (moduli.law[l] == MaterialLaw::corotated)
                for (Lanes& twist : response.twist) twist[l] = 0;
    ElementTangent& kept = pose.tangents[batch];
    kept = ElementTangent(stretches, response, volume);
    if (motion) add_motion(batch, F, *motion, pose, P);
    store_forces(batch, P, forces);
    LaneBlocks blocks;
    stiffness_blocks(kept, gradient_[batch], blocks);
    if (pose.damping != 0) add_damping(batch, pose, blocks);
    store_blocks(blocks, tets_of(batch), &pose.blocks[first_tet(batch)]);
}

}  // namespace nbd

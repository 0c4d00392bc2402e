// What rigid motion impulses on whole bodies give them against contacts.
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "sim/contact/contact_solver.hpp"

namespace nbd {
namespace {

/// The velocity of the point at an arm from a body's centre, from the body's rigid motion.
Eigen::Matrix<double, 3, 6> motion_at(const Eigen::Vector3d& arm) {
    Eigen::Matrix<double, 3, 6> G;
    G.leftCols<3>().setIdentity();
    G.rightCols<3>() << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
    return G;
}

}  // namespace

/// Impulse of the contact over a change of its relative velocity. Friction that slips does not change with
/// it.
Eigen::Matrix3d ContactSolver::resistance(std::size_t contact) const {
    const Eigen::Matrix3d& A = operators_[contact].A;
    if (drags_[contact].slip <= config_->slip_velocity) return A;
    const Eigen::Vector3d& n = contacts_[contact].normal;
    return n.dot(A * n) * n * n.transpose();
}

std::vector<RigidVector> ContactSolver::responses(std::span<const RigidVector> impulses,
                                                  std::span<const std::optional<RigidMatrix>> inertia,
                                                  const BodyPositions& at) const {
    std::vector<RigidMatrix> own(inertia.size());  // resistance of each body to itself
    std::vector<RigidMatrix> mutual(pairs_.size(),
                                    RigidMatrix::Zero());  // of the pair's first body to its second
    for (std::size_t b = 0; b < own.size(); ++b) own[b] = inertia[b].value_or(RigidMatrix::Identity());
    for (std::size_t c = 0; c < operators_.size(); ++c) {
        const auto [a, b] = std::pair(contacts_[c].a.body, contacts_[c].b.body);
        if (!presses(c) || a == b) continue;
        const Eigen::Vector3d point = terms_.acts_at(contacts_[c], c, at);
        const auto map = [&](int body) {
            return motion_at(point - at.centres[static_cast<std::size_t>(body)]);
        };
        const auto moves = [&](int body) { return body >= 0 && inertia[static_cast<std::size_t>(body)]; };
        const Eigen::Matrix3d A = resistance(c);
        for (const int body : {a, b})
            if (moves(body)) own[static_cast<std::size_t>(body)] += map(body).transpose() * A * map(body);
        if (const auto& [first, second] = pairs_[pair_of_[c]]; moves(first) && moves(second))
            mutual[pair_of_[c]] -= map(first).transpose() * A * map(second);
    }
    std::vector<Eigen::Triplet<double>> entries;
    const auto add_block = [&](int row, int column, const RigidMatrix& block) {
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j) entries.emplace_back(6 * row + i, 6 * column + j, block(i, j));
    };
    for (std::size_t b = 0; b < own.size(); ++b) add_block(static_cast<int>(b), static_cast<int>(b), own[b]);
    // The first body of a pair is the larger one: the lower half of the matrix.
    for (std::size_t pair = 0; pair < pairs_.size(); ++pair)
        if (!mutual[pair].isZero(0)) add_block(pairs_[pair][0], pairs_[pair][1], mutual[pair]);
    const auto size = static_cast<Eigen::Index>(6 * own.size());
    Eigen::SparseMatrix<double> matrix(size, size);
    matrix.setFromTriplets(entries.begin(), entries.end());
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(size);
    for (std::size_t b = 0; b < own.size(); ++b)
        if (inertia[b]) rhs.segment<6>(static_cast<Eigen::Index>(6 * b)) = impulses[b];
    const Eigen::VectorXd solved = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(rhs);
    std::vector<RigidVector> motions;
    for (std::size_t b = 0; b < own.size(); ++b)
        motions.push_back(solved.segment<6>(static_cast<Eigen::Index>(6 * b)));
    return motions;
}

}  // namespace nbd

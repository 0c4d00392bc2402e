// Rigid motions that impulses on whole bodies cause while contacts resist.
#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <limits>

#include "sim/contact/contact_solver.hpp"

namespace nbd {
namespace {

/// Maps a rigid motion to the velocity of a point.
using PointMotion = Eigen::Matrix<double, 3, 6>;

/// arm: of the point from the centre.
PointMotion motion_at(const Eigen::Vector3d& arm) {
    PointMotion G;
    G.leftCols<3>().setIdentity();
    G.rightCols<3>() << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
    return G;
}

/// How many times a bond resists more than a body's mass: as good as rigidly, and rounding leaves the
/// inertia.
constexpr double stiff_enough = 1e4;

std::size_t number(int body) { return body; }

}  // namespace

/// A contact or bond between two bodies of which at least one moves. Impulses act on the first body of its
/// pair, and the opposite ones on the second.
struct ContactSolver::Touch {
    std::size_t contact;
    std::array<PointMotion, 2> motion;  // from the motions of the pair; zero where a body does not move
    Eigen::Matrix3d R;                  // what it resists with, impulse over velocity, kg
    Eigen::Vector3d along;              // direction of the slip; zero where friction sticks
    Eigen::Vector3d resists{0, 0, 0}, friction{0, 0, 0};  // impulses, N s
};

std::vector<ContactSolver::Touch> ContactSolver::touches(const Eigen::VectorXd& v,
                                                         std::span<const std::optional<RigidMatrix>> inertia,
                                                         const ImpulsePlaces& at) const {
    std::vector<Touch> touches;
    for (std::size_t c = 0; c < operators_.size(); ++c) {
        const std::array<int, 2>& pair = pairs_[pair_of_[c]];
        const auto moves = [&](int body) { return body >= 0 && inertia[number(body)]; };
        if (!presses(c) || pair[0] == pair[1] || !(moves(pair[0]) || moves(pair[1]))) continue;
        Touch touch{.contact = c, .motion = {}, .R = operators_[c].A, .along = Eigen::Vector3d::Zero()};
        // Both arms are of one point, so that what a pair gets sums to nothing.
        const bool is_middle =
            c >= contacts_.size() && bonds_[c - contacts_.size()].acts_at == Bond::Time::middle;
        const BodyPositions& where = is_middle ? at.middles : at.ends;
        const Eigen::Vector3d point = terms_.acts_at(c, where);
        for (const std::size_t k : {0u, 1u})
            touch.motion[k] = moves(pair[k]) ? motion_at(point - where.centres[number(pair[k])])
                                             : PointMotion(PointMotion::Zero());
        if (c >= contacts_.size()) {  // a bond
            double mass = std::numeric_limits<double>::infinity();
            for (const int body : pair)
                if (moves(body)) mass = std::min(mass, (*inertia[number(body)])(0, 0));
            touch.R *= std::min(1.0, stiff_enough * mass / touch.R.norm());
            touches.push_back(touch);
            continue;
        }
        const Eigen::Vector3d slip = contacts_[c].slip(relative_velocity(c, v), dt_);
        if (const double speed = slip.norm(); speed > contacts_[c].full_slip(dt_)) {
            touch.along = slip / speed;  // along which friction does not change
            touch.R -= touch.along.dot(touch.R * touch.along) * touch.along * touch.along.transpose();
        }
        touches.push_back(touch);
    }
    return touches;
}

ContactSolver::RigidResponse ContactSolver::response(const Eigen::VectorXd& v,
                                                     std::span<const RigidVector> impulses,
                                                     std::span<const std::optional<RigidMatrix>> inertia,
                                                     const ImpulsePlaces& at) const {
    RigidResponse response{.motions = std::vector<RigidVector>(inertia.size(), RigidVector::Zero()),
                           .impulses = Eigen::VectorXd::Zero(v.size()),
                           .of_each = {}};
    std::vector<Touch> all = touches(v, inertia, at);
    std::vector<Eigen::Index> place(inertia.size(), -1);  // of the bodies that touch
    Eigen::Index count = 0;
    for (const Touch& touch : all)
        for (const int body : pairs_[pair_of_[touch.contact]])
            if (body >= 0 && inertia[number(body)] && place[number(body)] < 0) place[number(body)] = count++;
    for (std::size_t b = 0; b < inertia.size(); ++b)
        if (inertia[b] && place[b] < 0) response.motions[b] = inertia[b]->ldlt().solve(impulses[b]);
    if (count == 0) return response;

    // The lower half of the sum of inertia and resistance, by bodies and pairs of bodies.
    std::vector<RigidMatrix> own(count), mutual(pairs_.size(), RigidMatrix::Zero());
    Eigen::VectorXd given(6 * count);
    for (std::size_t b = 0; b < inertia.size(); ++b) {
        if (place[b] < 0) continue;
        own[place[b]] = *inertia[b];
        given.segment<6>(6 * place[b]) = impulses[b];
    }
    const auto place_of = [&](const Touch& touch, std::size_t k) {
        const int body = pairs_[pair_of_[touch.contact]][k];
        return body < 0 ? Eigen::Index{-1} : place[number(body)];
    };
    for (const Touch& touch : all) {
        for (const std::size_t k : {0u, 1u})
            if (const Eigen::Index i = place_of(touch, k); i >= 0)
                own[i] += touch.motion[k].transpose() * touch.R * touch.motion[k];
        mutual[pair_of_[touch.contact]] -= touch.motion[0].transpose() * touch.R * touch.motion[1];
    }
    std::vector<Eigen::Triplet<double>> entries;
    const auto add = [&](Eigen::Index row, Eigen::Index column, const RigidMatrix& block) {
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j) entries.emplace_back(6 * row + i, 6 * column + j, block(i, j));
    };
    for (Eigen::Index i = 0; i < count; ++i) add(i, i, own[i]);
    for (std::size_t pair = 0; pair < pairs_.size(); ++pair) {
        if (mutual[pair].isZero(0)) continue;
        const Eigen::Index i = place[number(pairs_[pair][0])], j = place[number(pairs_[pair][1])];
        if (i > j)
            add(i, j, mutual[pair]);
        else
            add(j, i, mutual[pair].transpose());
    }
    Eigen::SparseMatrix<double> A(given.size(), given.size());
    A.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(A);
    // Beside very stiff contacts, rounding may leave nothing of the inertia. They let nothing happen.
    if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 0)) return response;

    Eigen::VectorXd motions;
    constexpr int rounds = 4;  // for friction to follow what resists
    for (int round = 0; round < rounds; ++round) {
        Eigen::VectorXd b = given;
        for (Touch& touch : all) {
            if (touch.along.isZero(0)) continue;
            const Contact& contact = contacts_[touch.contact];
            touch.friction = -contact.friction * contact.normal.dot(touch.resists) * touch.along;
            for (const std::size_t k : {0u, 1u})
                if (const Eigen::Index i = place_of(touch, k); i >= 0)
                    b.segment<6>(6 * i) += (k == 0 ? 1 : -1) * touch.motion[k].transpose() * touch.friction;
        }
        motions = factor.solve(b);
        for (Touch& touch : all) {
            touch.resists.setZero();
            for (const std::size_t k : {0u, 1u})
                if (const Eigen::Index i = place_of(touch, k); i >= 0)
                    touch.resists -=
                        (k == 0 ? 1 : -1) * touch.R * touch.motion[k] * motions.segment<6>(6 * i);
        }
    }
    for (std::size_t b = 0; b < inertia.size(); ++b)
        if (place[b] >= 0) response.motions[b] = motions.segment<6>(6 * place[b]);
    response.of_each.assign(operators_.size(), Eigen::Vector3d::Zero());
    for (const Touch& touch : all) {
        const bool is_first = terms_.bodies(touch.contact)[0] == pairs_[pair_of_[touch.contact]][0];
        const Eigen::Vector3d impulse = (is_first ? 1 : -1) * (touch.resists + touch.friction);
        terms_.add_impulse(touch.contact, impulse, true, response.impulses);
        response.of_each[touch.contact] = impulse;
    }
    return response;
}

}  // namespace nbd

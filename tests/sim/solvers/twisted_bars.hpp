#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "sim/solvers/body_norms.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd::test {

/// Two twisted and bent bars, one fixed at an end, coupled at some nodes.
struct TwistedBars {
    static constexpr double dt = 0.01;
    ElasticBody body{box_mesh({2, 0.4, 0.4}, {24, 5, 5}), {.young = 1e5}};
    std::vector<StepSystem> systems;
    std::vector<int> first_unknown{0};
    std::vector<CouplingTerm> terms;
    std::vector<Coupling> couplings;
    Eigen::VectorXd b;

    explicit TwistedBars(double turns, double stiffness = 0) {
        systems.emplace_back(body);
        systems.emplace_back(body);
        for (int i = 0; i < 2; ++i) {
            BodyState state{body.rest().X, Nodes::Zero(body.node_count(), 3)};
            for (Eigen::Index k = 0; k < state.x.rows(); ++k) {
                const Eigen::Vector3d X = state.x.row(k);
                const Eigen::Matrix3d R = (Eigen::AngleAxisd(turns * X[0] / 2 + i, Eigen::Vector3d::UnitX()) *
                                           Eigen::AngleAxisd(0.5 * turns * X[0], Eigen::Vector3d::UnitZ()))
                                              .toRotationMatrix();
                state.x.row(k) = (R * (X - Eigen::Vector3d(1, 0.2, 0.2))).transpose();
                state.v(k, 1) = std::sin(3 * X[0]);
            }
            systems[i].assemble(state, dt, {.gravity = {0, 0, -9.81}, .forces = {}});
            first_unknown.push_back(first_unknown.back() + body.unknown_count());
        }
        systems[0].prescribe({.nodes = {0, 1, 2, 3, 4, 5}, .v = Nodes::Constant(6, 3, 0.1)});
        for (int k = 40; stiffness > 0 && k < 60; ++k) {
            Coupling coupling{.begin = static_cast<int>(terms.size())};
            terms.push_back({0, k, 3 * k, 1, systems[0].is_prescribed(k)});
            terms.push_back({1, k + 1, first_unknown[1] + 3 * (k + 1), -1, false});
            coupling.end = terms.size();
            const Eigen::Vector3d n = Eigen::Vector3d(std::sin(k), std::cos(k), 0.3).normalized();
            coupling.A = stiffness * n * n.transpose();
            couplings.push_back(coupling);
        }
        b.resize(first_unknown.back());
        for (std::size_t i = 0; i < 2; ++i)
            b.segment(first_unknown[i], body.unknown_count()) = systems[i].rhs();
    }

    CoupledSystem system() const { return {systems, first_unknown, terms, couplings}; }

    /// A share of the norm of each body's right-hand side.
    std::vector<double> goals(double share) const {
        std::vector<double> norms = body_norms().of(b);
        for (double& norm : norms) norm *= share;
        return norms;
    }

    /// The largest residual of a body, as a share of the norm of its right-hand side.
    double residual(const Eigen::VectorXd& v) const {
        Eigen::VectorXd product(v.size());
        system().multiply(v, product);
        return worst_share(body_norms().of(b - product), goals(1));
    }

 private:
    BodyNorms body_norms() const {
        BodyNorms norms;
        norms.begin(systems, first_unknown);
        return norms;
    }
};

}  // namespace nbd::test

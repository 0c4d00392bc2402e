// The cavities of bodies, and the gases in them. A gas is a spring of one unknown, its pressure, that all
// walls of a cavity share. The pressure is solved for beside the system: each try is a solve with the
// pressures given, and the secant of how the volumes answer leads to the next one.
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sim/world/world.hpp"

namespace nbd {

/// Makes the cavities of a body that is being added, and takes the gases out of its loads.
void World::add_cavities(Body& body, std::vector<BodyLoad>& loads) const {
    const std::vector<Shell>& shells = body.shape->cavities;
    for (int k = 0; k < std::ssize(shells); ++k) body.cavities.emplace_back(k, *body.elastic, *body.shape);
    for (BodyLoad& load : loads) {
        if (load.kind != LoadKind::gas) continue;
        check_gas(load, *body.elastic);
        const auto found = std::ranges::find(shells, load.faces, &Shell::faces);
        if (found == shells.end())
            throw std::invalid_argument("load: a gas needs the faces of one cavity of the body's surface");
        const int number = static_cast<int>(found - shells.begin());
        if (std::ranges::find(body.gases, number, &ClosedGas::cavity) != body.gases.end())
            throw std::invalid_argument(fmt::format("load: cavity {} has a gas already", number));
        const double volume = body.cavities[number].volume(body.state.x);
        if (!(volume > 0))
            throw std::invalid_argument(fmt::format("load: cavity {} encloses no volume", number));
        body.gases.push_back({.cavity = number,
                              .gas = load.gas,
                              .amount = std::move(load.factor),
                              .volume = volume,
                              .load = load.number});
    }
    std::erase_if(loads, [](const BodyLoad& load) { return load.kind == LoadKind::gas; });
}

/// Forces of gases on the nodes of a body at the positions x, [N, 3] newtons.
Nodes World::gas_forces(const Body& body, const Nodes& x, double time) const {
    Nodes forces = Nodes::Zero(x.rows(), 3);
    for (const ClosedGas& gas : body.gases) {
        const Cavity& cavity = body.cavities[gas.cavity];
        const Nodes slope = cavity.slope(x);
        forces += gas.pressure(cavity.volume(x, slope), time) * slope;
    }
    return forces;
}

/// Of the gases of a body at the positions x, joules.
double World::gas_energy(const Body& body, const Nodes& x) const {
    double sum = 0;
    for (const ClosedGas& gas : body.gases)
        sum += gas.energy(body.cavities[gas.cavity].volume(x), time_ + step_.dt);
    return sum;
}

/// Linearises the gases of a body at its unknown w.
void World::linearise_gases(int index, const Nodes& w) {
    const Body& body = at(index);
    const Nodes x = body.start.x + step_.dt * w;
    const double end = time_ + step_.dt;
    for (const ClosedGas& gas : body.gases) {
        const Cavity& cavity = body.cavities[gas.cavity];
        StepGas& one = gases_.emplace_back();
        one.body = index;
        one.gas = &gas;
        one.slope = cavity.slope(x);
        one.volume = cavity.volume(x, one.slope);
        one.pressure = one.solved = gas.pressure(one.volume, end);
        one.stiffness = gas.stiffness(one.volume, end);
        one.flow = one.slope.cwiseProduct(w).sum();
    }
}

/// Pressures of the linearised gases at the unknowns v of the step, Pa.
Eigen::VectorXd World::gas_pressures(const Eigen::VectorXd& v) const {
    Eigen::VectorXd pressures(std::ssize(gases_));
    for (std::size_t g = 0; g < gases_.size(); ++g) {
        const StepGas& one = gases_[g];
        const double flow = one.slope.cwiseProduct(body_part(one.body, v)).sum();
        pressures[g] = one.pressure - one.stiffness * step_.dt * (flow - one.flow);
    }
    return pressures;
}

/// Lets gases press as told in the systems of the step.
void World::set_gas_pressures(const Eigen::VectorXd& pressures) {
    for (std::size_t g = 0; g < gases_.size(); ++g) {
        StepGas& one = gases_[g];
        const Nodes more = (pressures[g] - one.solved) * one.slope;
        one.solved = pressures[g];
        systems_[one.body].add_impulses(step_.dt * more);
        at(one.body).gas_end += more;
    }
}

/// The least by which pressures push volumes back, as if the walls' nodes gave way one by one: how much of a
/// change of the pressures one that is tried leaves to be wrong, at first.
Eigen::MatrixXd World::first_gas_response() const {
    Eigen::MatrixXd response = Eigen::MatrixXd::Identity(std::ssize(gases_), std::ssize(gases_));
    for (std::size_t g = 0; g < gases_.size(); ++g) {
        const StepGas& one = gases_[g];
        const StepSystem& system = systems_[one.body];
        double softness = 0;
        for (Eigen::Index i = 0; i < one.slope.rows(); ++i)
            if (!system.is_prescribed(static_cast<int>(i)))
                softness += one.slope.row(i).squaredNorm() / (system.matrix().diagonal()[i].trace() / 3);
        response(g, g) += one.stiffness * step_.dt * step_.dt * softness;
    }
    return response;
}

/// Solves the systems of the step with the pressures that gases have at its solution.
ContactSolveReport World::solve_with_gases(Eigen::VectorXd& v) {
    if (gases_.empty()) return solver_.solve(systems_, v);
    constexpr double of_changes = 1e-3, of_absolute = 1e-7, poor = 100;
    const double of_pressures = 0.1 * std::min(1e-4, config_.step.newton_tolerance);
    const int most = 8 + 2 * static_cast<int>(gases_.size());
    Eigen::MatrixXd response = first_gas_response();
    Eigen::VectorXd pressures = gas_pressures(v), off, way;
    ContactSolveReport all;
    for (int round = 1;; ++round) {
        set_gas_pressures(pressures);
        ContactSolveReport report = solver_.solve(systems_, v);
        report.linear_iterations += all.linear_iterations;
        report.passes += all.passes;
        if (report.fallback.empty()) report.fallback = all.fallback;
        all = std::move(report);
        const Eigen::VectorXd found = gas_pressures(v), before = std::exchange(off, pressures - found);
        double worst = 0;
        for (std::size_t g = 0; g < gases_.size(); ++g) {
            const double now = gases_[g].pressure, ambient = gases_[g].gas->gas.ambient;
            const double allowed = std::max(of_changes * std::abs(found[g] - now),
                                            of_pressures * std::abs(now) + of_absolute * (now + ambient));
            worst = std::max(worst, std::abs(off[g]) / allowed);
        }
        if (worst <= 1) return all;
        if (round == most) {
            all.converged = all.converged && worst <= poor;
            return all;
        }
        if (round == 2) {  // each by its own secant
            for (std::size_t g = 0; g < gases_.size(); ++g)
                if (way[g] != 0) response(g, g) = std::max(1.0, (off[g] - before[g]) / way[g]);
        } else if (round > 2 && way.squaredNorm() > 0) {  // [Broyden65]
            response += (off - before - response * way) * way.transpose() / way.squaredNorm();
        }
        way = -response.partialPivLu().solve(off);
        pressures += way;
    }
}

/// By how much the pressures of gases at v are off those that were solved for, of their absolute ones or
/// those at the start.
double World::gas_error(const Eigen::VectorXd& v) const {
    double largest = 0;
    for (const StepGas& one : gases_) {
        const Body& body = at(one.body);
        const double volume =
            body.cavities[one.gas->cavity].volume(body.start.x + step_.dt * body_part(one.body, v));
        const double pressure = one.gas->pressure(volume, time_ + step_.dt);
        const double off = std::abs(pressure - one.solved) /
                           std::max(pressure + one.gas->gas.ambient, one.gas->gas.pressure);
        largest = std::max(largest, volume > 0 ? off : 1);
    }
    return largest;
}

/// The largest of 1, 1/2, 1/4 ... of the way from v to `to` in which no cavity with a gas loses more than
/// half of its volume.
double World::share_of_cavities(double dt, const Eigen::VectorXd& v, const Eigen::VectorXd& to) const {
    constexpr double least = 1e-6;
    double share = 1;
    for (int b = 0; b < body_count(); ++b)
        for (const ClosedGas& gas : at(b).gases) {
            const Cavity& cavity = at(b).cavities[gas.cavity];
            const auto volume = [&](double s) {
                return cavity.volume(at(b).start.x + dt * body_part(b, v + s * (to - v)));
            };
            const double before = volume(0);
            while (share > least && volume(share) < before / 2) share /= 2;
        }
    return share;
}

std::vector<CavityState> World::cavities() const {
    std::vector<CavityState> all;
    for (int b = 0; b < body_count(); ++b) {
        const Body& body = at(b);
        for (int k = 0; k < std::ssize(body.cavities); ++k) {
            const Cavity& cavity = body.cavities[k];
            CavityState& one = all.emplace_back();
            one.body = b;
            one.number = k;
            one.volume = cavity.volume(body.state.x);
            for (const ClosedGas& gas : body.gases)
                if (gas.cavity == k) one.pressure += gas.pressure(one.volume, time_);
            for (const LoadForces& load : body.loads)
                if (load.load().kind == LoadKind::pressure && load.load().faces == cavity.faces())
                    one.pressure += load.load().pressure * load.load().factor.at(time_, load_share(time_));
        }
    }
    return all;
}

}  // namespace nbd

#include "sim/world/gases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sim/world/secant.hpp"

namespace nbd {

void take_gases(SteppedBody& body, std::vector<BodyLoad>& loads) {
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

Nodes gas_forces(const SteppedBody& body, const Nodes& x, double time) {
    Nodes forces = Nodes::Zero(x.rows(), 3);
    for (const ClosedGas& gas : body.gases) {
        const Cavity& cavity = body.cavities[gas.cavity];
        const Nodes slope = cavity.slope(x);
        forces += gas.pressure(cavity.volume(x, slope), time) * slope;
    }
    return forces;
}

double gas_energy(const SteppedBody& body, const Nodes& x, double time) {
    double sum = 0;
    for (const ClosedGas& gas : body.gases) sum += gas.energy(body.cavities[gas.cavity].volume(x), time);
    return sum;
}

double share_of_cavities(const WorldState& world, const Eigen::VectorXd& v, const Eigen::VectorXd& to) {
    constexpr double least = 1e-6;
    double share = 1;
    for (int b = 0; b < world.body_count(); ++b)
        for (const ClosedGas& gas : world.at(b).gases) {
            const Cavity& cavity = world.at(b).cavities[gas.cavity];
            const auto volume = [&](double s) {
                return cavity.volume(world.at(b).start.x + world.dt * world.part_of(b, v + s * (to - v)));
            };
            const double before = volume(0);
            while (share > least && volume(share) < before / 2) share /= 2;
        }
    return share;
}

std::vector<CavityState> cavity_states(const WorldState& world) {
    std::vector<CavityState> all;
    for (int b = 0; b < world.body_count(); ++b) {
        const SteppedBody& body = world.at(b);
        for (int k = 0; k < std::ssize(body.cavities); ++k) {
            const Cavity& cavity = body.cavities[k];
            CavityState& one = all.emplace_back();
            one.body = b;
            one.number = k;
            one.volume = cavity.volume(body.state.x);
            for (const ClosedGas& gas : body.gases)
                if (gas.cavity == k) one.pressure += gas.pressure(one.volume, world.time);
            for (const LoadForces& load : body.loads)
                if (load.load().kind == LoadKind::pressure && load.load().faces == cavity.faces())
                    one.pressure += load.load().pressure *
                                    load.load().factor.at(world.time, world.load_share(world.time));
        }
    }
    return all;
}

void GasSolve::linearise(const WorldState& world, int index, const Nodes& w) {
    const SteppedBody& body = world.at(index);
    const Nodes x = body.start.x + world.dt * w;
    const double end = world.end();
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
Eigen::VectorXd GasSolve::pressures(const WorldState& world, const Eigen::VectorXd& v) const {
    Eigen::VectorXd pressures(std::ssize(gases_));
    for (std::size_t g = 0; g < gases_.size(); ++g) {
        const StepGas& one = gases_[g];
        const double flow = one.slope.cwiseProduct(world.part_of(one.body, v)).sum();
        pressures[g] = one.pressure - one.stiffness * world.dt * (flow - one.flow);
    }
    return pressures;
}

/// Lets gases press as told in the systems of the step.
void GasSolve::press(WorldState& world, const Eigen::VectorXd& pressures, std::vector<StepSystem>& systems) {
    for (std::size_t g = 0; g < gases_.size(); ++g) {
        StepGas& one = gases_[g];
        const Nodes more = (pressures[g] - one.solved) * one.slope;
        one.solved = pressures[g];
        systems[one.body].add_impulses(world.dt / world.at(one.body).velocity_factor * more);
        world.at(one.body).gas_end += more;
    }
}

/// The least by which pressures push volumes back, as if the walls' nodes gave way one by one: how much of a
/// change of the pressures one that is tried leaves to be wrong, at first.
Eigen::MatrixXd GasSolve::first_response(const WorldState& world,
                                         const std::vector<StepSystem>& systems) const {
    Eigen::MatrixXd response = Eigen::MatrixXd::Identity(std::ssize(gases_), std::ssize(gases_));
    for (std::size_t g = 0; g < gases_.size(); ++g) {
        const StepGas& one = gases_[g];
        const StepSystem& system = systems[one.body];
        double softness = 0;
        for (Eigen::Index i = 0; i < one.slope.rows(); ++i)
            if (!system.is_prescribed(static_cast<int>(i)))
                softness += one.slope.row(i).squaredNorm() / (system.matrix().diagonal()[i].trace() / 3);
        response(g, g) += one.stiffness * world.dt * world.dt / world.at(one.body).velocity_factor * softness;
    }
    return response;
}

ContactSolveReport GasSolve::solve(WorldState& world, StepEquations& equations, Eigen::VectorXd& v) {
    auto& [systems, steps, shapes, contacts, bonds, solver, are_balanced] = equations;
    if (gases_.empty()) return solver.solve(systems, v);
    constexpr double of_changes = 1e-3, of_absolute = 1e-7, poor = 100;
    const double of_pressures = 0.1 * std::min(1e-4, world.config.step.newton_tolerance);
    const int most = 8 + 2 * static_cast<int>(gases_.size());
    Secant secant(first_response(world, systems));
    Eigen::VectorXd tried = pressures(world, v);
    ContactSolveReport all;
    for (int round = 1;; ++round) {
        press(world, tried, systems);
        all.add_round(solver.solve(systems, v));
        const Eigen::VectorXd found = pressures(world, v), off = tried - found;
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
        tried += secant.way_from(off);
    }
}

double GasSolve::error(const WorldState& world, const Eigen::VectorXd& v) const {
    double largest = 0;
    for (const StepGas& one : gases_) {
        const SteppedBody& body = world.at(one.body);
        const double volume =
            body.cavities[one.gas->cavity].volume(body.start.x + world.dt * world.part_of(one.body, v));
        const double pressure = one.gas->pressure(volume, world.end());
        const double off = std::abs(pressure - one.solved) /
                           std::max(pressure + one.gas->gas.ambient, one.gas->gas.pressure);
        largest = std::max(largest, volume > 0 ? off : 1);
    }
    return largest;
}

}  // namespace nbd

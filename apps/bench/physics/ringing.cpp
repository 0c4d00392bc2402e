// What rings: frequencies against closed forms, and the energy that is left.
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_world.hpp"
#include "meshing/cage/cage_body.hpp"
#include "sim/fem/modes.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;

/// Lowest `count` frequencies of bending of a free Timoshenko beam in one plane, Hz [Huang61].
std::vector<double> bending_frequencies(double L, double a, const Material& m, int count) {
    const double E = m.young, G = E / (2 * (1 + m.poisson)), kGA = shear_coefficient(m.poisson) * G * a * a,
                 EI = E * std::pow(a, 4) / 12, mass = m.density * a * a,
                 rotary = m.density * std::pow(a, 4) / 12;
    // w = exp(s x), with the section's angle psi = (s^2 + mass omega^2 / kGA) / s w. At both ends, moment and
    // shear force vanish: psi' = 0 and w' = psi.
    const auto determinant = [&](double omega) {
        const double w2 = omega * omega, p = mass * w2 / kGA, q = rotary * w2 / EI, half = (p + q) / 2,
                     root = std::sqrt((p - q) * (p - q) / 4 + mass * w2 / EI);
        const double grows = std::sqrt(root - half), waves = std::sqrt(root + half);
        const double up = (grows * grows + p) / grows, round = (waves * waves - p) / waves;
        Eigen::Matrix4d ends;
        int row = 0;
        for (const double x : {0.0, L}) {
            const double scale = std::exp(-grows * L), ch = std::cosh(grows * x), sh = std::sinh(grows * x),
                         cs = std::cos(waves * x), sn = std::sin(waves * x), by = x > 0 ? scale : 1;
            // Of cosh, sinh, cos and sin: psi' and w' - psi.
            ends.row(row++) << by * up * grows * ch, by * up * grows * sh, -by * round * waves * cs,
                -by * round * waves * sn;
            ends.row(row++) << by * (grows - up) * sh, by * (grows - up) * ch, -by * (waves - round) * sn,
                by * (waves - round) * cs;
        }
        return ends.determinant();
    };
    std::vector<double> found;
    const double step = 0.002 * std::numbers::pi * std::sqrt(E / m.density) / L;
    double omega = step, before = determinant(omega);
    while (std::ssize(found) < count) {
        const double next = determinant(omega + step);
        if (before * next < 0) {
            double low = omega, high = omega + step;
            for (int k = 0; k < 60; ++k) {
                const double middle = (low + high) / 2;
                (determinant(middle) * before > 0 ? low : high) = middle;
            }
            found.push_back(low / (2 * std::numbers::pi));
        }
        omega += step;
        before = next;
    }
    return found;
}

Eigen::VectorXd lowest_frequencies(const ElasticBody& elastic, int count) {
    static std::mutex one;  // ARPACK keeps variables of a run
    const std::lock_guard lock(one);
    return vibration_modes(elastic, {.count = count}).basis.frequencies;
}

/// Of the lowest frequencies of a free bar of ten to one.
PhysicsOutcome worst_frequency(const ElasticBody& elastic, double L, int count) {
    const double a = 0.1 * L;
    const Material& material = elastic.material();
    const Eigen::VectorXd found = lowest_frequencies(elastic, count);
    std::vector<double> truth;
    for (const double f : bending_frequencies(L, a, material, count)) truth.insert(truth.end(), {f, f});
    const double shear = std::sqrt(material.young / (2 * (1 + material.poisson)) / material.density),
                 sound = std::sqrt(material.young / material.density);
    for (int n = 1; n <= count; ++n) {
        truth.push_back(n * shear * std::sqrt(6 * torsion_constant) / (2 * L));
        truth.push_back(n * sound / (2 * L));
    }
    std::ranges::sort(truth);
    PhysicsOutcome worst{};
    for (int k = 0; k < count; ++k) {
        const PhysicsOutcome here = relative_outcome(found[k], truth[k]);
        if (here.error > worst.error) worst = here;
    }
    return worst;
}

/// parameter: Poisson's ratio.
PhysicsOutcome ringing_bar(const PhysicsCase& c) {
    return worst_frequency(ElasticBody(bar_mesh(c), undamped_material(c, c.parameter)), c.size, 10);
}

/// A box askew in a cage of quadratic tetrahedra with so many corners.
ElasticBody caged(const Vector3d& size, int corners, const Material& material) {
    TriMesh box = box_surface(size, {1, 1, 1});
    box.X = (box.X * Eigen::AngleAxisd(0.4, Vector3d(1, 2, 3).normalized()).toRotationMatrix()).eval();
    return ElasticBody(make_cage_body("box", box, corners, material, Elements::quadratic).body);
}

/// parameter: corners of the cage.
PhysicsOutcome caged_bar(const PhysicsCase& c) {
    return worst_frequency(
        caged(c.size * Vector3d(1, 0.1, 0.1), static_cast<int>(c.parameter), undamped_material(c, 0.3)),
        c.size, 4);
}

/// A plate of a hundred to one. parameter: corners of the cage.
PhysicsOutcome caged_plate(const PhysicsCase& c) {
    const double L = c.size, t = 0.01 * L;
    const Material material = undamped_material(c, 0.3);
    const double stiffness = material.young * t * t * t / (12 * (1 - material.poisson * material.poisson));
    return relative_outcome(
        lowest_frequencies(caged({L, L, t}, static_cast<int>(c.parameter), material), 1)[0],
        13.489 / (L * L) * std::sqrt(stiffness / (material.density * t)) / (2 * std::numbers::pi));
}

/// Energy of a bar that rings lengthwise, after ten periods of 50 steps.
PhysicsOutcome ringing_energy(const PhysicsCase& c) {
    constexpr int periods = 10, steps = 50;
    constexpr double strain = 1e-3;
    const Material material = undamped_material(c, 0);
    const auto elastic =
        std::make_shared<const ElasticBody>(brick(c.size * Vector3d(1, 0.2, 0.2), {10, 2, 2}), material);
    WorldBody body = alone(elastic);
    const Nodes& X = elastic->rest().X;
    body.state = {X, Nodes::Zero(X.rows(), 3)};
    for (Eigen::Index i = 0; i < X.rows(); ++i)
        body.state.x(i, 0) +=
            strain * c.size / std::numbers::pi * std::sin(std::numbers::pi * X(i, 0) / c.size);
    World world = world_of(c, weightless(), {body});
    const double start = energy(world, 0, 0);
    double fastest = 0;
    for (int s = 0; s < periods * steps; ++s) {
        advance(world, c.dt);
        fastest = std::max(fastest, world.state(0).v.cwiseAbs().maxCoeff());
    }
    if (fastest < 0.5 * strain * speed_of_sound(c)) throw std::runtime_error("the bar does not ring");
    return relative_outcome(energy(world, 0, 0) / start, 1);
}

}  // namespace

std::vector<PhysicsCheck> ringing_checks() {
    std::vector<PhysicsCase> bars = bar_cases();
    for (PhysicsCase& c : bars) c.dt = 0;
    const auto cages = [](std::vector<double> corners) {
        PhysicsRange range = still_range;
        range.sizes = {0.01, 1, 100};
        range.steps = {0};
        range.parameters = std::move(corners);
        return range;
    };
    const PhysicsRange periods{.sizes = three_sizes, .steps = {0}};
    std::vector<PhysicsCase> lengthwise = all_cases(periods, 5);
    for (PhysicsCase& c : lengthwise) c.dt = 2 * c.size / speed_of_sound(c) / 50;
    return {
        {"bar_frequencies",
         "A free bar of ten to one, its surface of four cells across, "
         "has the ten lowest frequencies of a Timoshenko beam, Saint-Venant's torsion and sound.",
         "frequency, Hz", 0.03, bars, ringing_bar, "Poisson's ratio"},
        {"caged_bar",
         "The same bar in a cage of quadratic tetrahedra, which it fills by less than half, has the same four lowest.",
         "frequency, Hz", 0.03, all_cases(cages({50, 100, 200}), 4), caged_bar, "corners of the cage"},
        {"caged_plate",
         "A free square plate, a hundredth thick, in a cage of quadratic tetrahedra has a lowest frequency "
         "of 13.489 / L^2 sqrt(D / (rho t)) (Leissa).",
         "frequency, Hz", 0.05, all_cases(cages({100, 200, 400}), 4), caged_plate, "corners of the cage"},
        {"ringing_energy",
         "An undamped bar that rings lengthwise keeps 99 % of its energy "
         "over ten periods of 50 steps.",
         "share of energy left", 0.01, lengthwise, ringing_energy}};
}

}  // namespace nbd

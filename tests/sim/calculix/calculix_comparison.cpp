#include "tests/sim/calculix/calculix_comparison.hpp"

#include <fmt/format.h>

#include <cmath>

#include "sim/fem/modes.hpp"
#include "tests/sim/calculix/calculix.hpp"
#include "tests/sim/support/one_body_world.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd::test {
namespace {

// A body clamped at the low end of its longest side and loaded across it.
struct Clamped {
    ElasticBody elastic;
    Eigen::Index along = 0, across = 0;
    double length = 0;
    std::vector<int> held;

    explicit Clamped(const Body& body) : elastic(body.tets, undamped(body.material)) {
        const Nodes& X = body.tets.X;
        const Eigen::RowVector3d low = X.colwise().minCoeff(), size = X.colwise().maxCoeff() - low;
        length = size.maxCoeff(&along);
        size.minCoeff(&across);
        held = nodes_where(X, [&](const auto& p) { return p[along] < low[along] + 0.1 * length; });
    }
    static Material undamped(Material material) {
        material.rayleigh_mass = material.rayleigh_stiffness = 0;
        return material;
    }

    StaticCase weight(double g) const {
        StaticCase load{.held = held};
        load.gravity[across] = -g;
        return load;
    }
    StaticCase pull(double newtons) const {
        StaticCase load{.held = held};
        Eigen::Index node = 0;
        elastic.rest().X.col(along).maxCoeff(&node);
        load.pulled = node;
        load.pull[across] = newtons;
        return load;
    }
    Nodes displacements(const StaticCase& load, int load_steps = 1, int newton_iterations = 1) const {
        Loads loads{.gravity = load.gravity, .forces = Nodes::Zero(elastic.node_count(), 3)};
        loads.forces.row(load.pulled) = load.pull.transpose();
        return static_displacements(elastic, held, loads, {}, load_steps, newton_iterations);
    }
    Comparison compare(const StaticCase& load, const std::string& quantity) const {
        const Nodes ours = displacements(load);
        const Nodes theirs = calculix_displacements(elastic, load);
        const double largest = theirs.rowwise().norm().maxCoeff();
        return {quantity, ours.rowwise().norm().maxCoeff(), largest,
                (ours - theirs).rowwise().norm().maxCoeff() / largest};
    }
};

}  // namespace

std::vector<Comparison> compare_frequencies(const Body& body, int count) {
    std::vector<Comparison> rows;
    for (const MassKind mass : {MassKind::lumped, MassKind::consistent}) {
        const ElasticBody elastic(body.tets, body.material, mass);
        const Eigen::VectorXd ours = vibration_modes(elastic, {.count = count}).basis.frequencies;
        const Eigen::VectorXd theirs = calculix_frequencies(elastic, mass, count);
        const char* name = mass == MassKind::lumped ? "lumped" : "consistent";
        for (int i = 0; i < count; ++i)
            rows.push_back({fmt::format("frequency {} with {} mass [Hz]", i + 1, name), ours[i], theirs[i],
                            std::abs(ours[i] / theirs[i] - 1)});
    }
    return rows;
}

std::vector<Comparison> compare_deflections(const Body& body) {
    const Clamped clamped(body);
    const double g = 1e-3;
    return {clamped.compare(clamped.weight(g), "deflection under weight [m]"),
            clamped.compare(clamped.pull(g * clamped.elastic.mass()), "deflection under a pull [m]")};
}

Comparison compare_large_deflection(const Body& body, MaterialLaw law, double share) {
    Body of_law = body;
    of_law.material.law = law;
    const Clamped clamped(of_law);
    const double unit = clamped.displacements(clamped.weight(1)).rowwise().norm().maxCoeff();
    const StaticCase load = clamped.weight(share * clamped.length / unit);
    const Nodes ours = clamped.displacements(load, 10, 30);
    const Nodes theirs = calculix_displacements(clamped.elastic, load, true);
    const double largest = theirs.rowwise().norm().maxCoeff();
    return {fmt::format("large deflection under weight ({}) [m]", name(law)),
            ours.rowwise().norm().maxCoeff(), largest, (ours - theirs).rowwise().norm().maxCoeff() / largest};
}

}  // namespace nbd::test

#include "apps/bench/elements/element_study.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "apps/bench/measure/measure.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/factor/cholesky.hpp"
#include "sim/fem/held_statics.hpp"

namespace nbd {
namespace {

constexpr Eigen::Index most_tets = 160'000;  // of the reference; 108,544 took 5.4 GB of memory

/// Equilibrium of one mesh.
struct Equilibrium {
    ElementRow row;
    Nodes u;          // of the body's own nodes, m
    double work = 0;  // of the load; twice the elastic energy, J
};

/// The body's material, the axis along which its weight acts, and how many nodes are its own.
struct Load {
    Material material;
    Eigen::Index down;
    Eigen::Index own_nodes;
};

double processor_ms(auto&& work) {
    const double start = processor_seconds();
    work();
    return 1e3 * (processor_seconds() - start);
}

/// held: nodes, [N].
Equilibrium find_equilibrium(const TetMesh& mesh, const std::vector<char>& held, const Load& load,
                             int repeats) {
    const ElasticBody elastic(mesh, load.material);
    const HeldStatics statics(elastic, held);
    Nodes weight = Nodes::Zero(elastic.node_count(), 3);
    weight.col(load.down) = -9.81 * elastic.node_masses();
    const Eigen::VectorXd f = statics.loads(weight);
    SparseMatrix K = statics.stiffness();
    Eigen::VectorXd u(f.size());
    Cholesky factor;
    factor.analyze(K);
    std::vector<double> assembly, factorisation, solve;
    for (int k = 0; k < repeats; ++k) {
        assembly.push_back(processor_ms([&] { K = statics.stiffness(); }));
        factorisation.push_back(processor_ms([&] { factor.factorize(K); }));
        solve.push_back(processor_ms([&] { factor.solve(f, u); }));
    }
    Equilibrium result{.row = {.body = {},
                               .nodes_per_tet = mesh.is_quadratic() ? 10 : 4,
                               .tets = elastic.element_count(),
                               .nodes = elastic.node_count(),
                               .unknowns = statics.unknown_count(),
                               .nonzeros = K.nonZeros(),
                               .assembly = median(assembly),
                               .factorisation = median(factorisation),
                               .solve = median(solve)},
                       .u = statics.displacements(u).topRows(load.own_nodes),
                       .work = f.dot(u)};
    return result;
}

/// How far a sequence is from its limit if its steps go on shrinking as the last two did.
double left_over(double step_before, double last_step) {
    const double shrinking = step_before / last_step;
    return shrinking > 1 ? last_step / (shrinking - 1) : std::numeric_limits<double>::quiet_NaN();
}

/// Fills in the errors; the last one is the reference.
void measure_errors(std::vector<Equilibrium>& found) {
    Equilibrium& best = found.back();
    const double size = best.u.norm();
    std::vector<const Equilibrium*> quadratic;
    for (Equilibrium& e : found) {
        if (e.row.nodes_per_tet == 10) quadratic.push_back(&e);
        e.row.displacement = (e.u - best.u).norm() / size;
        e.row.energy = std::sqrt(std::max(0.0, (best.work - e.work) / best.work));
    }
    best.row.reference = true;
    best.row.displacement = best.row.energy = std::numeric_limits<double>::quiet_NaN();
    if (quadratic.size() < 3) return;
    const Equilibrium &last = *quadratic[quadratic.size() - 2], &before = *quadratic[quadratic.size() - 3];
    best.row.displacement = left_over((last.u - before.u).norm(), (best.u - last.u).norm()) / size;
    best.row.energy = std::sqrt(left_over(last.work - before.work, best.work - last.work) / best.work);
}

/// How often the body can be split, `most` times at most.
int levels_of(const Body& body, int most) {
    int levels = 0;
    for (Eigen::Index tets = 8 * body.tets.T.rows(); levels < most && tets <= most_tets; tets *= 8) ++levels;
    if (levels == 0)
        throw std::runtime_error(fmt::format("{}: {} tetrahedra; allowed: at most {}", body.name,
                                             body.tets.T.rows(), most_tets / 8));
    return levels;
}

}  // namespace

std::vector<ElementRow> study_elements(const Body& body, const ElementStudyConfig& config, Output& out) {
    const int levels = levels_of(body, config.levels);
    const EndOfBody end = end_of_body(body.tets);
    const Load load{
        .material = {.poisson = config.poisson}, .down = end.shortest, .own_nodes = body.tets.X.rows()};
    std::vector<Equilibrium> found;
    const auto add = [&](int level, const TetMesh& mesh, const std::vector<char>& held, int repeats) {
        out.progress(fmt::format("{}: {} nodes", body.name, mesh.X.rows()), found.size(), 2 * levels + 3);
        try {
            found.push_back(find_equilibrium(mesh, held, load, repeats));
        } catch (const std::runtime_error& error) {
            throw std::runtime_error(
                fmt::format("{}: no equilibrium of {} nodes: {}", body.name, mesh.X.rows(), error.what()));
        }
        found.back().row.body = body.name;
        found.back().row.level = level;
    };
    TetMesh mesh = body.tets;
    mesh.fill = {};  // elements are compared on one shape; that of split ones in a cage would be another
    std::vector<char> held = end.nodes;
    for (int level = 0; level <= levels; ++level) {
        const bool last = level == levels;
        const TetMesh quadratic = make_quadratic(mesh);
        TetMesh finer = split(quadratic);  // on the same nodes
        const std::vector<char> held_of_both = end_of_quadratic(quadratic, held);
        add(level, mesh, held, config.repeats);
        if (last) add(level + 1, finer, held_of_both, 1);
        add(level, quadratic, held_of_both, last ? 1 : config.repeats);
        mesh = std::move(finer);
        held = held_of_both;
    }
    measure_errors(found);
    std::vector<ElementRow> rows;
    for (const Equilibrium& e : found) rows.push_back(e.row);
    return rows;
}

namespace {

CostRatios ratios(const ElementRow& linear, const ElementRow& quadratic) {
    return {.unknowns = static_cast<double>(linear.unknowns) / quadratic.unknowns,
            .nonzeros = static_cast<double>(linear.nonzeros) / quadratic.nonzeros,
            .milliseconds = linear.total() / quadratic.total()};
}

}  // namespace

bool is_compared(const ElementRow& row) noexcept { return row.nodes_per_tet == 10 && !row.reference; }

std::optional<CostRatios> equal_error(std::span<const ElementRow> rows, const ElementRow& quadratic,
                                      double ElementRow::*error) {
    const double wanted = quadratic.*error;
    const ElementRow* coarser = nullptr;
    for (const ElementRow& row : rows) {
        if (row.body != quadratic.body || row.nodes_per_tet != 4) continue;
        if (row.*error <= wanted) {
            if (!coarser) return {};
            const double share = std::log(wanted / coarser->*error) / std::log(row.*error / coarser->*error);
            const auto between = [&](double from, double to) { return from * std::pow(to / from, share); };
            const CostRatios from = ratios(*coarser, quadratic), to = ratios(row, quadratic);
            return CostRatios{.unknowns = between(from.unknowns, to.unknowns),
                              .nonzeros = between(from.nonzeros, to.nonzeros),
                              .milliseconds = between(from.milliseconds, to.milliseconds)};
        }
        coarser = &row;
    }
    if (!coarser) return {};
    CostRatios least = ratios(*coarser, quadratic);
    least.at_least = true;
    return least;
}

Rows to_rows(std::span<const ElementRow> rows) {
    Rows table;
    for (const ElementRow& r : rows) {
        table.push_back({{"body", r.body},
                         {"nodes_per_tet", r.nodes_per_tet},
                         {"level", r.level},
                         {"reference", r.reference},
                         {"tets", r.tets},
                         {"nodes", r.nodes},
                         {"unknowns", r.unknowns},
                         {"nonzeros", r.nonzeros},
                         {"displacement_error", r.displacement},
                         {"energy_error", r.energy},
                         {"assembly_ms", r.assembly},
                         {"factorisation_ms", r.factorisation},
                         {"solve_ms", r.solve}});
        for (const auto& [name, error] : {std::pair("displacement", &ElementRow::displacement),
                                          std::pair("energy", &ElementRow::energy)}) {
            const auto ratios = is_compared(r) ? equal_error(rows, r, error) : std::nullopt;
            const auto add = [&, name = name](const char* what, auto value) {
                nlohmann::ordered_json& cell = table.back()[fmt::format("{}_{}", name, what)];
                if (ratios) cell = (*ratios).*value;
            };
            add("unknowns_ratio", &CostRatios::unknowns);
            add("nonzeros_ratio", &CostRatios::nonzeros);
            add("ms_ratio", &CostRatios::milliseconds);
            add("at_least", &CostRatios::at_least);
        }
    }
    return table;
}

}  // namespace nbd

#include <fmt/core.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <iterator>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/elements/element_study.hpp"
#include "apps/cli/mesh_file.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "meshing/cage/cage.hpp"
#include "sim/factor/blas.hpp"

namespace nbd {
namespace {

struct BenchElementsArguments {
    std::vector<std::string> bodies;
    std::vector<int> cages{100, 300};
    std::string csv;
    ElementStudyConfig config;
};

/// The body of a file with tetrahedra, or those of a surface, named after their numbers of nodes.
std::vector<Body> bodies_to_compare(const std::string& path, const std::vector<int>& cages,
                                    const Output& out) {
    if (holds_tets(path)) return {body_of_tets(path, {}, out)};
    std::vector<Body> bodies;
    for (const int nodes : cages) {
        MeshFileConfig config;
        config.cage = nodes;
        bodies.push_back(body_of_surface(path, config, out).body);
        bodies.back().name += fmt::format("_{}", bodies.back().tets.X.rows());
    }
    return bodies;
}

/// Throws std::runtime_error if there are rows of a body of that name: names tell rows of bodies apart.
void require_new_name(const Body& body, std::span<const ElementRow> rows) {
    if (std::ranges::any_of(rows, [&](const ElementRow& row) { return row.body == body.name; }))
        throw std::runtime_error(
            fmt::format("two bodies are called {}; allowed: different names", body.name));
}

void run(const BenchElementsArguments& arguments, Output& out) {
    hold_blas_to_one_thread();
    const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    if (const BlasInfo blas = blas_info(); !blas.fast) out.warning(blas.warning);
    if (!arguments.csv.empty())
        check_output(arguments.csv, {arguments.bodies.begin(), arguments.bodies.end()}, ".csv");
    std::vector<ElementRow> rows;
    for (const std::string& path : arguments.bodies)
        for (const Body& body : bodies_to_compare(path, arguments.cages, out)) {
            require_new_name(body, rows);
            const std::vector<ElementRow> found = study_elements(body, arguments.config, out);
            rows.insert(rows.end(), found.begin(), found.end());
        }
    const Rows table = to_rows(rows);
    out.text(
        "errors are shares; medians in ms of processor time, one thread; the last row of a body is the reference");
    out.text(to_text(table,
                     {"body", "nodes_per_tet", "level", "nodes", "unknowns", "nonzeros", "displacement_error",
                      "energy_error", "assembly_ms", "factorisation_ms", "solve_ms"}));
    Rows ratios;
    std::ranges::copy_if(table, std::back_inserter(ratios),
                         [](const auto& row) { return !row["displacement_at_least"].is_null(); });
    out.text(
        "linear tetrahedra of the same error in displacement cost so many times as much; at_least: or more");
    out.text(to_text(ratios, {"body", "level", "displacement_unknowns_ratio", "displacement_nonzeros_ratio",
                              "displacement_ms_ratio", "displacement_at_least"}));
    if (!arguments.csv.empty()) write_csv(arguments.csv, table);
    out.result(table);
}

}  // namespace

void add_bench_elements(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<BenchElementsArguments>(
        app, out, "elements", "Compares tetrahedra of four and of ten nodes at equal error", run);
    command.add_option("BODIES", arguments.bodies, "Body files or other tetrahedra, or surfaces")->required();
    command
        .add_option("--cage", arguments.cages,
                    "Sizes of cages around surfaces, in tet nodes; 0: the surface itself is filled")
        ->delimiter(',')
        ->check(whole_number(0, max_cage_nodes));
    command
        .add_option("--levels", arguments.config.levels,
                    "How often tetrahedra are split into eight for the reference, at most")
        ->check(whole_number(1, 4));
    command.add_option("--repeats", arguments.config.repeats, "Times are medians over so many")
        ->check(whole_number(1, 1'000'000));
    command.add_option("--poisson", arguments.config.poisson, "Poisson's ratio")->check(between(0.01, 0.49));
    command.add_option("-o,--output", arguments.csv, "Table to write, CSV");
}

}  // namespace nbd

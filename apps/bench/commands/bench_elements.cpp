#include <fmt/core.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
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

std::string in_words(const std::optional<CostRatios>& r) {
    if (!r) return "linear ones are better";
    return fmt::format("{}{:6.2f} {:6.2f} {:6.2f}", r->at_least ? ">" : " ", r->unknowns, r->nonzeros,
                       r->milliseconds);
}

void tell(const ElementRow& r, const Output& out) {
    out.text(fmt::format("{:14} {:9} {:6} {:8} {:8} {:9} {:>12.3f} {:>8.3f} {:10.2f} {:11.2f} {:9.2f}{}",
                         r.body, r.nodes_per_tet, r.level, r.nodes, r.unknowns, r.nonzeros,
                         100 * r.displacement, 100 * r.energy, r.assembly, r.factorisation, r.solve,
                         r.reference ? "  reference, its errors extrapolated" : ""));
}

void tell_ratios(std::span<const ElementRow> rows, const Output& out) {
    out.text("linear tetrahedra of the same error cost so many times as many unknowns, non-zeros and ms:");
    out.text("body           level   in displacement          in energy");
    for (const ElementRow& row : rows)
        if (is_compared(row))
            out.text(fmt::format("{:14} {:5}   {}   {}", row.body, row.level,
                                 in_words(equal_error(rows, row, &ElementRow::displacement)),
                                 in_words(equal_error(rows, row, &ElementRow::energy))));
}

nlohmann::ordered_json to_json(const std::optional<CostRatios>& r) {
    if (!r) return nullptr;
    return {{"unknowns", r->unknowns},
            {"nonzeros", r->nonzeros},
            {"ms", r->milliseconds},
            {"at_least", r->at_least}};
}

nlohmann::ordered_json to_json(std::span<const ElementRow> rows, const ElementRow& row) {
    nlohmann::ordered_json result{{"body", row.body},
                                  {"nodes_per_tet", row.nodes_per_tet},
                                  {"level", row.level},
                                  {"reference", row.reference},
                                  {"tets", row.tets},
                                  {"nodes", row.nodes},
                                  {"unknowns", row.unknowns},
                                  {"nonzeros", row.nonzeros},
                                  {"displacement_error", row.displacement},
                                  {"energy_error", row.energy},
                                  {"assembly_ms", row.assembly},
                                  {"factorisation_ms", row.factorisation},
                                  {"solve_ms", row.solve}};
    if (is_compared(row)) {
        result["equal_displacement_error"] = to_json(equal_error(rows, row, &ElementRow::displacement));
        result["equal_energy_error"] = to_json(equal_error(rows, row, &ElementRow::energy));
    }
    return result;
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
    out.text("errors in percent; medians in ms of processor time, one thread");
    out.text(
        "body         nodes a tet  level    nodes unknowns non-zeros displacement   energy   assembly + "
        "factorise +    solve");
    nlohmann::ordered_json result = nlohmann::ordered_json::array();
    for (const ElementRow& row : rows) {
        tell(row, out);
        result.push_back(to_json(rows, row));
    }
    tell_ratios(rows, out);
    if (!arguments.csv.empty()) write_table(arguments.csv, rows);
    out.result(result);
}

}  // namespace

void add_bench_elements(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<BenchElementsArguments>();
    CLI::App* elements =
        app.add_subcommand("elements", "Compares tetrahedra of four and of ten nodes at equal error");
    elements->add_option("BODIES", arguments->bodies, "Body files or other tetrahedra, or surfaces")
        ->required();
    elements
        ->add_option("--cage", arguments->cages,
                     "Sizes of cages around surfaces, in tet nodes; 0: the surface itself is filled")
        ->delimiter(',')
        ->check(whole_number(0, max_cage_nodes))
        ->capture_default_str();
    elements
        ->add_option("--levels", arguments->config.levels,
                     "How often tetrahedra are split into eight for the reference, at most")
        ->check(whole_number(1, 4))
        ->capture_default_str();
    elements->add_option("--repeats", arguments->config.repeats, "Times are medians over so many")
        ->check(whole_number(1, 1'000'000))
        ->capture_default_str();
    elements->add_option("--poisson", arguments->config.poisson, "Poisson's ratio")
        ->check(between(0.01, 0.49))
        ->capture_default_str();
    elements->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    elements->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd

#include <fmt/core.h>

#include <memory>
#include <utility>

#include "apps/bench/accuracy/strengths.hpp"
#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/measure/machine.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

struct BenchStrengthsArguments {
    std::vector<std::pair<std::string, std::string>> sets;  // tree, dataset
    std::vector<std::string> bounds{"exact", "bd", "nbd", "learned_spheres", "certified"};
    std::string csv;
};

void run(const BenchStrengthsArguments& arguments, Output& out) {
    for (const auto& [tree, data] : arguments.sets)
        if (!arguments.csv.empty()) check_output(arguments.csv, {tree, data}, ".csv");
    std::vector<BoundKind> bounds;
    for (const std::string& bound : arguments.bounds) bounds.push_back(bound_kind(bound));
    std::vector<StrengthSet> sets;
    nlohmann::ordered_json result = nlohmann::ordered_json::array();
    for (const auto& [tree, data] : arguments.sets) {
        out.work(fmt::format("{}, set {} of {}", data, sets.size() + 1, arguments.sets.size()));
        const StrengthSet& set = sets.emplace_back(measure_strength(tree, data, bounds));
        out.text(
            fmt::format("{}: strength {:g}, displacement {:.3g} % of the body's length, stretches {:.3f} to "
                        "{:.3f} (98 % of them), {:.3f} to {:.3f} (all)\n{}",
                        set.name, set.strength, 100 * set.displacement, set.stretch_low, set.stretch_high,
                        set.least_stretch, set.largest_stretch, to_text(set.accuracy)));
        for (const Accuracy& accuracy : set.accuracy) {
            nlohmann::ordered_json row = {{"tree", set.name},
                                          {"seed", set.seed},
                                          {"strength", set.strength},
                                          {"displacement", set.displacement},
                                          {"stretch_1_percent", set.stretch_low},
                                          {"stretch_99_percent", set.stretch_high},
                                          {"least_stretch", set.least_stretch},
                                          {"largest_stretch", set.largest_stretch}};
            row.update(to_json(accuracy));
            result.push_back(row);
        }
    }
    if (!arguments.csv.empty()) {
        h5::AtomicFile file(arguments.csv);
        file.out() << "# " << this_machine() << '\n' << to_csv(sets);
        file.commit();
    }
    out.result(result);
}

}  // namespace

void add_bench_strengths(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<BenchStrengthsArguments>();
    CLI::App* command =
        app.add_subcommand("strengths", "How tight bounds are on datasets of growing strength of the motion");
    command->footer("Each tree is measured on the frames of its dataset that training did not see.");
    command->add_option("--set", arguments->sets, "Tree file and the dataset that it was trained on; repeat")
        ->required();
    command->add_option("--bounds", arguments->bounds, "Bounds to measure, separated by commas")
        ->delimiter(',')
        ->capture_default_str()
        ->check(bounds_name());
    command->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd

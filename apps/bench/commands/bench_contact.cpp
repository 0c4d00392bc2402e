#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/steps/contact_runs.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "sim/factor/blas.hpp"

namespace nbd {
namespace {

struct ContactArguments {
    std::vector<std::string> scenes;
    std::string csv, pictures;
    ContactRunConfig config;
};

/// A line of the table.
template <class... Cells>
std::string row(const Cells&... cells) {
    return fmt::format(
        "{:19} {:7} {:>4} {:>9} {:>8} {:>5} {:>8} {:>4} {:>7} {:>8} {:>8} {:>6} {:>7} "
        "{:>7} {:>7} {:>6} {:>7}  {}",
        cells...);
}

std::string percent(double part, double whole) {
    return fmt::format("{:.1f}", 100 * part / std::max(whole, 1e-9));
}

void tell(const ContactRun& r, Output& out) {
    const auto number = [](double value) {
        return std::isfinite(value) ? fmt::format("{:.2g}", value) : "-";
    };
    out.text(row(r.scene, r.mode, r.seed, fmt::format("{}/{}", r.steps, r.planned), r.intersecting, r.worst,
                 number(r.least_distance), r.cut, r.troubled, r.inverted, number(r.momentum_error),
                 fmt::format("{:.1f}", r.linearisations), fmt::format("{:.1f}", r.ms),
                 percent(r.search_ms, r.ms), percent(r.detect_ms, r.ms), percent(r.solve_ms, r.ms),
                 r.patches > 0 ? percent(r.patches_proved, r.patches) : "-", r.failure));
}

void run(const ContactArguments& arguments, Output& out) {
    hold_blas_to_one_thread();
    ContactRunConfig config = arguments.config;
    config.pictures = arguments.pictures;
    if (!arguments.csv.empty()) check_output(arguments.csv, {}, ".csv");
    if (!arguments.pictures.empty()) make_folder(arguments.pictures);
    out.text(row("scene", "mode", "runs", "steps", "crossing", "worst", "distance", "cut", "trouble",
                 "inverted", "momentum", "newton", "ms", "search%", "detect%", "solve%", "proved%", ""));
    std::vector<ContactRun> runs;
    nlohmann::ordered_json result = nlohmann::ordered_json::array();
    bool broken = false;
    for (const std::string& scene : arguments.scenes) {
        const std::vector<ContactRun> of_scene = run_contact_scene(scene, config, out);
        const std::size_t seeds = config.seeds;
        for (std::size_t first = 0; first < of_scene.size(); first += seeds) {
            const ContactRun all = together(std::span(of_scene).subspan(first, seeds));
            tell(all, out);
            result.push_back({{"scene", all.scene},
                              {"mode", all.mode},
                              {"runs", all.seed},
                              {"steps", all.steps},
                              {"intersecting", all.intersecting},
                              {"troubled", all.troubled},
                              {"ms", all.ms}});
            broken = broken || (all.mode == "free" && all.intersecting > 0);
        }
        runs.insert(runs.end(), of_scene.begin(), of_scene.end());
    }
    if (!arguments.csv.empty()) write_contact_table(arguments.csv, runs);
    out.result({{"scenes", result}});
    if (broken) throw std::runtime_error("a step without intersections ended with one");
}

}  // namespace

void add_bench_contact(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<ContactArguments>();
    CLI::App* command = app.add_subcommand("contact",
                                           "Runs scenes as they are, "
                                           "with `self_contact` and with `intersection_free`, "
                                           "and counts what went wrong");
    command->add_option("SCENES", arguments->scenes, "Scene files")->required();
    command
        ->add_option("--seeds", arguments->config.seeds, "Runs of each scene; all but the first are jittered")
        ->check(whole_number(1, 1000))
        ->capture_default_str();
    command->add_option("--jitter", arguments->config.jitter, "Largest change of a body's velocity, m/s")
        ->check(between(0, 1e3))
        ->capture_default_str();
    command->add_option("--seconds", arguments->config.seconds, "Time after which a run is stopped")
        ->check(between(1, 1e6))
        ->capture_default_str();
    command->add_option("--pictures", arguments->pictures, "Folder for pictures of the first runs");
    command->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    command->footer(
        "crossing, worst: pairs of faces that intersect at the ends of steps, in all and in one\n"
        "distance: the least between near features, m; trouble: steps that went wrong\n"
        "momentum: its largest error in a step, relative; newton: linearisations a step\n"
        "Exit status 1 if a step without intersections ended with one.");
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd

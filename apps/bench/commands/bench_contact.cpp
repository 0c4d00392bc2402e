#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/contact/contact_runs.hpp"
#include "apps/cli/interrupt.hpp"
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

void tell(const ContactRun& r, Output& out) {
    out.text(fmt::format(
        "{:19} {:7} {:4} {:3}/{:<3} {:6} {:6} {:9.2g} {:4} {:5} {:4} {:9} {:6.1f} {:9.1f} {:5.1f} {:5.1f} "
        "{:5.1f}{}",
        r.scene, r.mode, r.seed, r.steps, r.planned, r.intersecting, r.worst, r.least_distance, r.cut,
        r.troubled, r.inverted, std::isnan(r.momentum_error) ? "-" : fmt::format("{:.1e}", r.momentum_error),
        r.linearisations, r.ms, 100 * r.search_ms / r.ms, 100 * r.detect_ms / r.ms, 100 * r.solve_ms / r.ms,
        r.failure.empty() ? "" : "  " + r.failure));
}

void run(const ContactArguments& arguments, Output& out) {
    finish_on_interrupt();
    hold_blas_to_one_thread();
    ContactRunConfig config = arguments.config;
    config.pictures = arguments.pictures;
    if (!arguments.csv.empty()) check_output(arguments.csv, {});
    if (!arguments.pictures.empty()) make_folder(arguments.pictures);
    out.text(
        "                                 steps    intersecting     least            inver-  momentum linea- "
        " "
        "       ms   share in %\n"
        "scene               mode    seed done      sum  worst  distance  cut troub. ted      error    ris.  "
        " "
        " a step search detect solve");
    std::vector<ContactRun> runs;
    bool broken = false;
    for (const std::string& scene : arguments.scenes)
        for (ContactRun& run : run_contact_scene(scene, config, out)) {
            tell(run, out);
            broken = broken || (run.mode == "free" && run.intersecting > 0);
            runs.push_back(std::move(run));
        }
    if (!arguments.csv.empty()) write_contact_table(arguments.csv, runs);
    if (broken) throw std::runtime_error("a step without intersections ended with one");
}

}  // namespace

void add_bench_contact(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<ContactArguments>();
    CLI::App* command = app.add_subcommand("contact",
                                           "Runs scenes as they are, with `self_contact` and with "
                                           "`intersection_free`, and counts what went wrong");
    command->add_option("SCENES", arguments->scenes, "Scene files")->required()->check(CLI::ExistingFile);
    command
        ->add_option("--seeds", arguments->config.seeds, "Runs of each scene; all but the first are jittered")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    command->add_option("--jitter", arguments->config.jitter, "Largest change of a body's velocity, m/s")
        ->check(between(0, 1e3))
        ->capture_default_str();
    command->add_option("--seconds", arguments->config.seconds, "Time after which a run is stopped")
        ->check(between(1, 1e6))
        ->capture_default_str();
    command->add_option("--pictures", arguments->pictures, "Folder for pictures of the first runs");
    command->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    command->footer("Exit status 1 if a step without intersections ended with one.");
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd

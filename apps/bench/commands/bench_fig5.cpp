#include <memory>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/measure/measure.hpp"
#include "apps/bench/pairs/own_methods.hpp"
#include "apps/bench/pairs/race.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/drawing/chart.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

struct Figure5Arguments {
    std::string recording, folder;
    std::vector<std::vector<std::string>> bodies;
    std::vector<std::string> bounds{"exact", "nbd"};
    double distance = 0.01;
    int frames = 40;
    RaceConfig race;
};

std::vector<PairMethodEntry> methods_for(const std::vector<std::string>& bounds, const BenchBody& body) {
    std::vector<PairMethodEntry> methods;
    for (const std::string& bound : bounds)
        if (const BoundKind kind = bound_kind(bound); has_bounds(*body.tree, kind))
            methods.push_back(tree_method(kind));
    return methods;
}

void run(const Figure5Arguments& arguments, Output& out) {
    check_output_folder(arguments.folder);
    check_charts();
    const RecordingReader recording(arguments.recording);
    const std::vector<BenchBody> bodies = load_bench_bodies(arguments.bodies);
    const double radius = static_cast<double>(bodies.front().tree->spheres.rest[0].r);
    const auto scenes = recorded_scenes(bodies.front(), recording,
                                        static_cast<float>(arguments.distance * radius), arguments.frames);
    RaceTable table{"recorded", "file", {}};
    for (const BenchBody& body : bodies) {
        const auto methods = methods_for(arguments.bounds, body);
        const auto rows =
            race(body, methods, scenes, arguments.race, [&](const std::string& method, double share) {
                out.progress(fmt::format("figure 5, {} faces", body.faces()), 100 * share, 100, method);
            });
        table.rows.insert(table.rows.end(), rows.begin(), rows.end());
    }
    if (table.rows.empty()) throw std::runtime_error("none of the trees has any of the requested bounds");
    out.text(this_machine());
    out.text(to_text(table));
    make_folder(arguments.folder);
    const std::filesystem::path folder = arguments.folder;
    h5::AtomicFile csv(folder / "figure5.csv");
    csv.out() << to_csv(std::span(&table, 1));
    csv.commit();
    draw_chart("figure5", folder / "figure5.csv", folder / "figure5.png");
    nlohmann::ordered_json result = nlohmann::ordered_json::array();
    for (const RaceRow& row : table.rows)
        result.push_back({{"faces", row.faces},
                          {"method", row.method},
                          {"update_us", row.update_us},
                          {"query_us", row.query_us},
                          {"total_us", row.total_us},
                          {"pairs", row.pairs},
                          {"recall", row.recall()}});
    out.result(result);
}

}  // namespace

void add_bench_fig5(CLI::App& bench, Output& out) {
    auto arguments = std::make_shared<Figure5Arguments>();
    CLI::App* command =
        bench.add_subcommand("fig5", "The paper's figure 5: total, update and collision time by faces");
    command->footer(
        "SCENE is what `nbdtree simulate` recorded of two copies of the first body; "
        "the frames in which they\n"
        "touch are asked for on each body's surface.");
    command->add_option("SCENE", arguments->recording, "Recording of a scene of two bodies")->required();
    add_bodies(*command, arguments->bodies);
    command->add_option("-o,--output", arguments->folder, "Folder to write figure5.csv and figure5.png to")
        ->required();
    command->add_option("--bounds", arguments->bounds, "Bounds to compare")
        ->delimiter(',')
        ->check(bounds_name())
        ->capture_default_str();
    command
        ->add_option("--distance", arguments->distance,
                     "Use frames in which the surfaces come at least this close, in radii of the body")
        ->check(between(0, 1))
        ->capture_default_str();
    command->add_option("--frames", arguments->frames, "Maximum number of these frames, evenly spread")
        ->check(whole_number(1, 1'000'000))
        ->capture_default_str();
    add_race_limits(*command, arguments->race);
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd

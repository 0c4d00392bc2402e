#include <algorithm>
#include <cmath>
#include <memory>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/commands/bench_options.hpp"
#include "apps/bench/measure/machine.hpp"
#include "apps/bench/pairs/load_bench_bodies.hpp"
#include "apps/bench/pairs/scaling.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "training/files/frame_stream.hpp"

namespace nbd {
namespace {

struct ScalingArguments {
    std::string recording, folder;
    std::vector<std::vector<std::string>> bodies;
    ScalingConfig config;
};

void write(const std::filesystem::path& path, const std::string& text) {
    h5::AtomicFile file(path);
    file.out() << text;
    file.commit();
}

void run(const ScalingArguments& arguments, Output& out) {
    check_output_folder(arguments.folder);
    const RecordingReader recording(arguments.recording);
    const std::vector<BenchBody> bodies = load_bench_bodies(arguments.bodies);
    check_recording(bodies.front().surface, recording);
    const std::vector<FrameId> frames = unseen_frames(bodies, recording);
    const auto progress = [&](const std::string& what) {
        out.text(what);
        out.work(what);
    };
    out.text(this_machine());
    const auto crowds = race_crowds(bodies.front(), recording, frames, arguments.config, progress);
    const auto depths =
        race_by_depth(bodies.front(), bodies.back(), recording, frames, arguments.config, progress);

    out.text(to_csv(depths));
    out.text(to_csv(crowds));
    const double from = crossover(depths);
    out.text(std::isfinite(from)
                 ? fmt::format("exact bounds are faster from a depth of {:g} % of the radius on", 100 * from)
                 : std::string("exact bounds are not faster at the largest depth"));
    make_folder(arguments.folder);
    const std::filesystem::path folder = arguments.folder;
    write(folder / "scaling_depth.csv", to_csv(depths));
    write(folder / "scaling_bodies.csv", to_csv(crowds));
    nlohmann::ordered_json by_depth = nlohmann::ordered_json::array(), by_bodies = by_depth;
    for (const DepthRow& row : depths)
        by_depth.push_back({{"depth", row.depth},
                            {"method", row.race.method},
                            {"total_us", row.race.total_us},
                            {"pairs", row.race.pairs},
                            {"recall", row.race.recall()}});
    for (const CrowdRow& row : crowds)
        by_bodies.push_back({{"bodies", row.bodies},
                             {"threads", row.threads},
                             {"method", row.method},
                             {"total_us", row.total_us},
                             {"pairs", row.pairs}});
    out.result(
        {{"depth", by_depth},
         {"bodies", by_bodies},
         {"crossover", std::isfinite(from) ? nlohmann::ordered_json(from) : nlohmann::ordered_json()}});
}

}  // namespace

void add_bench_scaling(CLI::App& bench, Output& out) {
    auto arguments = std::make_shared<ScalingArguments>();
    ScalingConfig& config = arguments->config;
    CLI::App* command = bench.add_subcommand(
        "scaling", "Times queries by depth of penetration, touching faces, and number of bodies and threads");
    command->footer(
        "Depths are timed on the last body, crowds on the first. For times by number of faces: nbdtree-bench "
        "peers.");
    command->add_option("DATA", arguments->recording, "Recording of the first body")->required();
    add_bodies(*command, arguments->bodies);
    command->add_option("-o,--output", arguments->folder, "Folder to write tables to")->required();
    command->add_option("--depths", config.depths, "How far one body moves on after first contact, in radii")
        ->delimiter(',')
        ->check(between(0, 2))
        ->capture_default_str();
    command->add_option("--bodies", config.bodies, "Sizes of crowds")
        ->delimiter(',')
        ->check(whole_number(2, 100'000))
        ->capture_default_str();
    command->add_option("--spacing", config.spacing, "Distance between bodies of a crowd, in radii")
        ->check(positive())
        ->capture_default_str();
    command
        ->add_option("--crowd-threads", config.threads,
                     "Numbers of threads to time a crowd on; lazy boxes use one")
        ->delimiter(',')
        ->check(whole_number(1, 256))
        ->capture_default_str();
    command->add_option("--cluster", config.cluster_faces, "Faces per cluster of lazy boxes")
        ->check(whole_number(1, 4096))
        ->capture_default_str();
    command->add_option("--scenes", config.scenes, "Scenes per depth")
        ->check(whole_number(1, 10'000))
        ->capture_default_str();
    add_race_limits(*command, config.race);
    command->add_option("--seed", config.seed, "Seed of the scenes")
        ->check(seed_check())
        ->capture_default_str();
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd

#include <fmt/core.h>

#include <memory>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/kernels/kernel_times.hpp"
#include "apps/bench/measure/machine.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "training/files/frame_stream.hpp"
#include "training/files/surface_body.hpp"

namespace nbd {
namespace {

struct KernelsArguments {
    std::string tree, recording, csv;
    int nodes = 256, poses = 8;
};

std::string to_csv(const std::vector<KernelTime>& times) {
    std::string text = "kernel,ns,plain_ns,ratio,difference\n";
    for (const KernelTime& t : times)
        text += fmt::format("{},{:.1f},{:.1f},{:.2f},{:.2e}\n", t.name, t.ours_ns, t.plain_ns, t.ratio(),
                            t.difference);
    return text;
}

void run(const KernelsArguments& arguments, Output& out) {
    if (!arguments.csv.empty()) check_output(arguments.csv, {arguments.tree, arguments.recording}, ".csv");
    const TreeFile file = load_tree(arguments.tree);
    const SurfaceBody body = surface_body(file);
    const RecordingReader recording(arguments.recording);
    check_recording(body, recording);
    const std::vector<FrameId> frames = spread(complete_frames(recording), arguments.poses);
    std::vector<Vertices> poses(frames.size());
    for_each_frame(body, recording, frames,
                   [&](int, int index, VerticesRef x) { poses[static_cast<std::size_t>(index)] = x; });
    out.work("timing kernels");
    const std::vector<KernelTime> times = time_kernels(file.tree, poses, arguments.nodes);
    if (times.empty())
        throw std::runtime_error(
            fmt::format("{}: has neither learned nor nbd bounds to time", arguments.tree));
    out.text(this_machine());
    out.text(fmt::format("{} vertices, one thread, warm; medians in ns", file.tree.vertex_count));
    out.text("kernel            ns  plain Eigen   ratio");
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const KernelTime& t : times) {
        out.text(fmt::format("{:12} {:7.0f} {:12.0f} {:6.1f}x", t.name, t.ours_ns, t.plain_ns, t.ratio()));
        rows.push_back({{"kernel", t.name},
                        {"ns", t.ours_ns},
                        {"plain_ns", t.plain_ns},
                        {"ratio", t.ratio()},
                        {"difference", t.difference}});
    }
    if (!arguments.csv.empty()) {
        h5::AtomicFile csv(arguments.csv);
        csv.out() << to_csv(times);
        csv.commit();
    }
    out.result({{"kernels", rows}});
}

}  // namespace

void add_bench_kernels(CLI::App& bench, Output& out) {
    auto arguments = std::make_shared<KernelsArguments>();
    CLI::App* command = bench.add_subcommand(
        "kernels", "Times nodes of learned and nbd bounds and modal coordinates, beside plain Eigen");
    command->add_option("TREE", arguments->tree, "Tree file with learned or nbd bounds")->required();
    command->add_option("DATA", arguments->recording, "Recording of its body")->required();
    command->add_option("--nodes", arguments->nodes, "Number of nodes, evenly spread over the tree")
        ->check(whole_number(1, 10'000'000))
        ->capture_default_str();
    command->add_option("--poses", arguments->poses, "Number of poses, evenly spread over the recording")
        ->check(whole_number(1, 100'000))
        ->capture_default_str();
    command->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd

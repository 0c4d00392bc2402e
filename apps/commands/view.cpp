#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/commands/commands.hpp"
#include "apps/source/shown_source.hpp"
#include "apps/view/page.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "meshing/surface/counted.hpp"

namespace nbd {
namespace {

struct ViewArguments {
    SourceArgument shown;
    std::string output;
};

/// Reads what the argument names. Throws one line that names the wrong part.
ViewScene read_view(const SourceArgument& argument, Output& out) {
    if (!names_recording(argument)) return view_of_surface(argument);
    return view_of_recording(open_recording(argument, out));
}

/// The most face pairs of a kind in one frame.
std::uint32_t most(const ViewScene& scene, std::uint32_t PairCounts::*count) {
    std::uint32_t result = 0;
    for (const PairCounts& frame : scene.pairs) result = std::max(result, frame.*count);
    return result;
}

long sum(const ViewScene& scene, std::uint32_t PairCounts::*count) {
    long result = 0;
    for (const PairCounts& frame : scene.pairs) result += frame.*count;
    return result;
}

void tell(const ViewArguments& arguments, const ViewScene& scene, double seconds, Output& out) {
    const auto bytes = std::filesystem::file_size(arguments.output);
    long faces = 0;
    for (const ViewBody& body : scene.bodies) faces += body.F.rows();
    const std::string of = static_cast<int>(scene.frames()) < scene.recorded_frames
                               ? fmt::format(" of {}", scene.recorded_frames)
                               : "";
    out.text(fmt::format("{}: {}{}, {}, {} faces; {:.2f} MB, {:.1f} s", arguments.output,
                         counted(scene.frames(), "frame"), of, counted(scene.bodies.size(), "body", "bodies"),
                         faces, 1e-6 * static_cast<double>(bytes), seconds));
    const long missed = sum(scene, &PairCounts::intersecting_missed),
               near_missed = sum(scene, &PairCounts::near_missed);
    if (scene.is_audited)
        out.text(
            fmt::format("audit of all frames: {} of {} touching face pairs missed, {} of {} within {:.3g} m",
                        missed, sum(scene, &PairCounts::intersecting), near_missed,
                        sum(scene, &PairCounts::near), scene.contact_distance));
    out.result({{"page", arguments.output},
                {"frames", scene.frames()},
                {"recorded_frames", scene.recorded_frames},
                {"bodies", scene.bodies.size()},
                {"faces", faces},
                {"bytes", bytes},
                {"seconds", seconds},
                {"contact_distance", scene.contact_distance},
                {"most_intersecting_pairs", most(scene, &PairCounts::intersecting)},
                {"most_near_pairs", most(scene, &PairCounts::near)},
                {"audited", scene.is_audited},
                {"intersecting_pairs_missed", missed},
                {"near_pairs_missed", near_missed}});
}

void run(const ViewArguments& arguments, Output& out) {
    const Stopwatch watch;
    check_output(arguments.output, files_of(arguments.shown), ".html");
    out.work("reading");
    const ViewScene scene = read_view(arguments.shown, out);
    out.work("writing the page");
    h5::AtomicFile file(arguments.output);
    write_page(file.out(), scene);
    file.commit();
    tell(arguments, scene, 1e-6 * watch.microseconds(), out);
}

}  // namespace

void add_view(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<ViewArguments>(
        app, out, "view", "Writes a page that shows a recording in a browser", run);
    command.footer(
        "SOURCE: the recording of a scene; RECORDING.h5:trajectory with --body, "
        "or TREE.h5@RECORDING.h5:trajectory,\n"
        "each with :frame for one pose; TREE.h5@SURFACE; or a surface file. "
        "The page is one file that fetches nothing.\n"
        "In the page, ? lists the keys.");
    SourceArgument& shown = arguments.shown;
    command.add_option("SOURCE", shown.source, "What to show, see below")->required();
    command.add_option("-o,--output", arguments.output, "Page to write (HTML)")->required();
    command.add_option("--frames", shown.frames, "Most frames to show, evenly spread over all")
        ->check(whole_number(1, 100'000));
    command.add_option("--scene", shown.scene,
                       "Scene file, or its folder, of a recording that was moved away from it");
    command.add_option("--body", shown.body,
                       "Body file of RECORDING.h5:trajectory; with it, stress is shown");
    command.add_option("--bounds", shown.bounds, "Bounds to draw and to audit, instead of the scene's")
        ->check(bounds_name());
    command
        .add_option("--margin", shown.margin, "Share added to these bounds' radii, instead of the scene's")
        ->check(between(0, 10));
}

}  // namespace nbd

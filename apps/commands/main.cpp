// The program `nbdtree`.
#include "apps/cli/program.hpp"
#include "apps/commands/commands.hpp"

namespace {

std::string first_steps() {
    return "nbdtree simulates deformable solids and finds their collisions. First steps:\n"
           "\n"
           "  nbdtree validate assets/scenes/rings.json                     check a scene\n"
           "  nbdtree simulate assets/scenes/rings.json -o rings.h5         simulate it\n"
           "  nbdtree view rings.h5 -o rings.html                           see it in a browser\n"
           "  nbdtree inspect rings.h5                                      see what a file holds\n"
           "  nbdtree mesh assets/beam.obj -o beam.h5                       make a body of a surface\n"
           "  nbdtree dataset beam.h5 -o poses.h5                           simulate poses to train on\n"
           "  nbdtree train beam.h5 poses.h5 -o tree.h5 --bounds learned_affine\n"
           "                                                                train bounds of its tree\n"
           "\n"
           "nbdtree --help lists all commands, nbdtree COMMAND --help the options of one.\n";
}

std::map<std::string, std::string> command_examples() {
    return {
        {"mesh",
         "  nbdtree mesh assets/beam.obj -o beam.h5\n"
         "  nbdtree mesh scan.ply -o scan.h5 --cage 2000      # any triangle soup"},
        {"modes",
         "  nbdtree modes beam.h5 -m 128\n"
         "  nbdtree modes beam.h5 -m 20 --csv frequencies.csv"},
        {"dataset",
         "  nbdtree dataset beam.h5 -o poses.h5 --trajectories 40 --frames 50 --seed 1\n"
         "  mpirun -n 4 nbdtree dataset beam.h5 -o poses.h5 --recipe recipe.json"},
        {"remap",
         "  nbdtree remap poses.h5 --from beam.h5 --to fine_beam.h5 -o fine_poses.h5\n"
         "  nbdtree remap poses.h5 --from beam.h5 --to fine_beam.h5 -o fine_poses.h5 --trajectories 10"},
        {"train",
         "  nbdtree train beam.h5 poses.h5 -o tree.h5\n"
         "  nbdtree train beam.h5 poses.h5 -o tree.h5 --bounds learned_affine --miss-rate 0.01"},
        {"calibrate",
         "  nbdtree calibrate tree.h5 poses.h5 -o calibrated.h5 --miss-rate 0.01\n"
         "  nbdtree calibrate tree.h5 other_poses.h5 -o calibrated.h5"},
        {"evaluate",
         "  nbdtree evaluate tree.h5 poses.h5 --csv bounds.csv\n"
         "  nbdtree evaluate tree.h5 poses.h5 --bounds nbd,exact --margins 0,0.05"},
        {"transfer",
         "  nbdtree transfer tree.h5 fine_beam.h5 -o fine_tree.h5\n"
         "  nbdtree transfer tree.h5 fine_beam.h5 -o fine_tree.h5 --quiet"},
        {"export",
         "  nbdtree export --flat tree.h5 -o tree.nbd         # for programs that embed the library\n"
         "  nbdtree export run.h5 --gltf clip.glb --frames 60 # a short clip, as morph targets\n"
         "  nbdtree export run.h5 --mdd clip.mdd              # a point cache, and clip_rest.obj that it "
         "moves"},
        {"coverage",
         "  nbdtree coverage tree.h5 poses.h5 --contacts 20\n"
         "  nbdtree coverage tree.h5 poses.h5 --bounds learned_affine --csv coverage.csv"},
        {"simulate",
         "  nbdtree simulate scene.json -o run.h5 --csv steps.csv --picture run.png\n"
         "  nbdtree simulate scene.json -o run.h5 --resume    # goes on after Ctrl-C\n"
         "  nbdtree simulate scene.json -o run.h5 --live      # watch it in a browser meanwhile"},
        {"race",
         "  nbdtree race scene.json\n"
         "  nbdtree race scene.json --frames 20 --csv race.csv"},
        {"view",
         "  nbdtree view run.h5 -o run.html                   # opens in any browser, nothing is fetched\n"
         "  nbdtree view poses.h5:3 --body beam.h5 -o pose.html"},
        {"validate",
         "  nbdtree validate scene.json\n"
         "  nbdtree validate scene.json --json"},
        {"collide",
         "  nbdtree collide a.obj b.obj --within 0.01 --pairs near.csv\n"
         "  nbdtree collide tree.h5@poses.h5:0:3 tree.h5@poses.h5:1:3 --bounds boxes"},
        {"inspect",
         "  nbdtree inspect tree.h5\n"
         "  nbdtree inspect --check poses.h5 --body beam.h5"},
    };
}

nbd::Program describe() {
    const auto add_commands = [](CLI::App& app, nbd::Output& out) {
        nbd::add_mesh(app, out);
        nbd::add_modes(app, out);
        nbd::add_dataset(app, out);
        nbd::add_remap(app, out);
        nbd::add_train(app, out);
        nbd::add_calibrate(app, out);
        nbd::add_evaluate(app, out);
        nbd::add_transfer(app, out);
        nbd::add_export(app, out);
        nbd::add_coverage(app, out);
        nbd::add_simulate(app, out);
        nbd::add_race(app, out);
        nbd::add_validate(app, out);
        nbd::add_collide(app, out);
        nbd::add_inspect(app, out);
        nbd::add_view(app, out);
    };
    return {.name = "nbdtree",
            .description = "Deformable solids with learned collision culling.",
            .add_commands = add_commands,
            .gone = {{"bench", "run the program `nbdtree-bench`"},
                     {"carry", "use `nbdtree remap`"},
                     {"coverage --memory", "leave it out; it was for --splits"},
                     {"coverage --splits", "leave it out; the held-out trajectories tell as much"},
                     {"dataset --intersection-free", "leave it out; no pose intersects"},
                     {"dataset --self-contact", "leave it out; bodies always meet themselves"},
                     {"dataset --solver", "leave it out; steps are always solved by iteration"},
                     {"evaluate --all-depths", "use `--csv`, whose table has every depth"},
                     {"evaluate --html",
                      "use `--csv`, whose table draw_charts.py draws; `nbdtree coverage` judges"},
                     {"export --torch",
                      "tree files hold the networks as plain arrays, in nbd/ (apps/docs/formats.md)"},
                     {"figures", "use `nbdtree evaluate --csv`, whose tables draw_charts.py draws"},
                     {"simulate --arrows", "pages of `nbdtree view` show reactions as arrows"},
                     {"simulate --compare-contacts", "leave it out; all contacts count"},
                     {"simulate --contacts", "leave it out; all contacts count"},
                     {"train --anchors", "leave it out; affine bounds need none"},
                     {"train --label-frame", "leave it out; `--network paper` takes the full frame"},
                     {"train --linear-centre", "leave it out; `--network paper` has no linear part"},
                     {"train --local-network", "leave it out; learned_affine bounds have no network"},
                     {"train --local-samples", "leave it out; learned_affine bounds have no samples"},
                     {"train --radius-network", "leave it out; learned_affine bounds have no network"},
                     {"train --random-frames", "leave it out; a tenth of the frames is kept"},
                     {"train --samples", "leave it out; learned_affine bounds have no samples"},
                     {"train --weight-decay", "leave it out; `--network paper` has none"},
                     {"trust", "use `nbdtree coverage`"}},
            .first_steps = first_steps(),
            .examples = command_examples()};
}

}  // namespace

// Visible, so that the program may be a library, too (apps/archive).
[[gnu::visibility("default")]] int main(int argc, char** argv) {
    return nbd::run_program(describe, argc, argv);
}

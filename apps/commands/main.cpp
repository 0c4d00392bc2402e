// The program `nbdtree`.
#include "apps/cli/program.hpp"
#include "apps/commands/commands.hpp"

namespace {

nbd::Program describe() {
    const auto add_commands = [](CLI::App& app, nbd::Output& out) {
        nbd::add_mesh(app, out);
        nbd::add_modes(app, out);
        nbd::add_dataset(app, out);
        nbd::add_remap(app, out);
        nbd::add_train(app, out);
        nbd::add_calibrate(app, out);
        nbd::add_evaluate(app, out);
        nbd::add_figures(app, out);
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
                     {"dataset --solver", "leave it out; steps are always solved by iteration"},
                     {"export --torch",
                      "tree files hold the networks as plain arrays, in nbd/ (apps/docs/formats.md)"},
                     {"train --anchors", "leave it out; affine bounds need none"},
                     {"train --local-network", "leave it out; learned_affine bounds have no network"},
                     {"train --local-samples", "leave it out; learned_affine bounds have no samples"},
                     {"train --radius-network", "leave it out; learned_affine bounds have no network"},
                     {"train --samples", "leave it out; learned_affine bounds have no samples"},
                     {"trust", "use `nbdtree coverage`"}},
            .first_steps = nbd::first_steps(),
            .examples = nbd::command_examples()};
}

}  // namespace

int main(int argc, char** argv) { return nbd::run_program(describe, argc, argv); }

// The program `nbdtree-bench`.
#include <map>
#include <string>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/cli/program.hpp"

namespace {

/// Lines that end the --help of each benchmark.
std::map<std::string, std::string> examples() {
    return {{"simulate",
             "  nbdtree-bench simulate armadillo.h5 bunny.h5 --steps 20 -o steps.csv\n"
             "  nbdtree-bench simulate assets/gecko.obj --nodes 2500,5000,10000 --threads 1"},
            {"elements",
             "  nbdtree-bench elements assets/beam.obj assets/gecko.obj -o elements.csv\n"
             "  nbdtree-bench elements assets/gecko.obj --cage 200 --levels 2"},
            {"peers",
             "  nbdtree-bench peers poses.h5 --body beam.h5 tree.h5 -o peers\n"
             "  nbdtree-bench peers poses.h5 --body beam.h5 tree.h5 --methods 'affine,lazy boxes*' -o peers"},
            {"exactness",
             "  nbdtree-bench exactness beam.h5 --scenes 400 -o exactness.csv\n"
             "  nbdtree-bench exactness beam.h5 gear.h5 --scenes 100 --seed 2"},
            {"fig5",
             "  nbdtree-bench fig5 scene.h5 --body beam.h5 tree.h5 --body fine.h5 fine_tree.h5 -o figure5\n"
             "  nbdtree-bench fig5 scene.h5 --body beam.h5 tree.h5 --bounds exact,nbd,affine -o figure5"},
            {"contact",
             "  nbdtree-bench contact scene.json -o contact.csv\n"
             "  nbdtree-bench contact scene.json --seconds 60 --pictures pictures -o contact.csv"},
            {"impacts",
             "  nbdtree-bench impacts --random 1000000\n"
             "  nbdtree-bench impacts queries -o impacts.csv      # a folder of queries with exact answers"},
            {"physics",
             "  nbdtree-bench physics --quick\n"
             "  nbdtree-bench physics free_fall landing -o physics.csv"},
            {"threads",
             "  nbdtree-bench threads assets/scenes/heap.json --skip 60 --steps 5 -o threads.csv\n"
             "  nbdtree-bench threads --dataset beam.h5 --train beam.h5 poses.h5"}};
}

/// Benchmarks that are no longer there, with what to do instead.
std::map<std::string, std::string> gone() {
    return {
        {"kernels", "`nbdtree-bench peers` times whole queries, with --instructions also of other kernels"},
        {"learned", "`nbdtree train` and `nbdtree coverage` tell how tight a body's learned bounds are"},
        {"local", "`nbdtree train` and `nbdtree coverage` tell how tight a body's learned bounds are"},
        {"scaling",
         "`nbdtree-bench peers --heavy` takes deeper contact, `nbdtree race` a scene of many bodies"},
        {"solvers", "`nbdtree-bench simulate` times the solver of steps beside a factorisation"},
        {"laws", "`nbdtree mesh --law`, then `nbdtree-bench simulate`, time steps of a law"},
        {"ring", "`nbdtree-bench physics ringing_energy` tells what energy the integrator keeps"},
        {"physics --picture", "`draw_charts.py physics` draws the table of -o"},
        {"networks",
         "`nbdtree train` with and without --network paper, then `nbdtree evaluate`, compare them"},
        {"strengths",
         "`nbdtree dataset --strength`, `nbdtree train` and `nbdtree evaluate` measure one strength"},
        {"self", "`nbdtree-bench contact` runs scenes in which bodies meet themselves"}};
}

nbd::Program describe() {
    const auto add_commands = [](CLI::App& app, nbd::Output& out) {
        nbd::add_bench_simulate(app, out);
        nbd::add_bench_elements(app, out);
        nbd::add_bench_peers(app, out);
        nbd::add_bench_exactness(app, out);
        nbd::add_bench_fig5(app, out);
        nbd::add_bench_contact(app, out);
        nbd::add_bench_impacts(app, out);
        nbd::add_bench_physics(app, out);
        nbd::add_bench_threads(app, out);
    };
    return {.name = "nbdtree-bench",
            .description = "Measures nbdtree beside other methods and libraries.",
            .add_commands = add_commands,
            .gone = gone(),
            .first_steps = {},
            .examples = examples()};
}

}  // namespace

int main(int argc, char** argv) { return nbd::run_program(describe, argc, argv); }

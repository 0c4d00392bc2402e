// The program `nbdtree-bench`.
#include "apps/bench/commands/bench_commands.hpp"
#include "apps/cli/program.hpp"

namespace {

nbd::Program describe() {
    const auto add_commands = [](CLI::App& app, nbd::Output& out) {
        nbd::add_bench_simulate(app, out);
        nbd::add_bench_laws(app, out);
        nbd::add_bench_ring(app, out);
        nbd::add_bench_solvers(app, out);
        nbd::add_bench_elements(app, out);
        nbd::add_bench_learned(app, out);
        nbd::add_bench_peers(app, out);
        nbd::add_bench_exactness(app, out);
        nbd::add_bench_fig5(app, out);
        nbd::add_bench_scaling(app, out);
        nbd::add_bench_kernels(app, out);
        nbd::add_bench_networks(app, out);
        nbd::add_bench_strengths(app, out);
        nbd::add_bench_contact(app, out);
        nbd::add_bench_impacts(app, out);
        nbd::add_bench_self(app, out);
        nbd::add_bench_physics(app, out);
    };
    return {.name = "nbdtree-bench",
            .description = "Measures nbdtree beside other methods and libraries.",
            .add_commands = add_commands,
            .gone = {{"local", "use `nbdtree-bench learned`"}},
            .first_steps = {},
            .examples = nbd::bench_examples()};
}

}  // namespace

int main(int argc, char** argv) { return nbd::run_program(describe, argc, argv); }

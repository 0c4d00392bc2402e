#include "apps/bench/commands/bench_commands.hpp"

namespace nbd {

std::map<std::string, std::string> bench_examples() {
    return {
        {"simulate",
         "  nbdtree-bench simulate armadillo.h5 bunny.h5 --steps 20 -o steps.csv\n"
         "  nbdtree-bench simulate assets/gecko.obj --nodes 2500,5000,10000 --threads 1"},
        {"laws",
         "  nbdtree-bench laws beam.h5 -o laws.csv\n"
         "  nbdtree-bench laws beam.h5 --steps 6"},
        {"ring",
         "  nbdtree-bench ring beam.h5 -o ring.csv\n"
         "  nbdtree-bench ring beam.h5 --json"},
        {"solvers",
         "  nbdtree-bench solvers armadillo.h5 bunny.h5 -o solvers.csv\n"
         "  nbdtree-bench solvers beam.h5 --repeats 1"},
        {"elements",
         "  nbdtree-bench elements assets/beam.obj assets/gecko.obj -o elements.csv\n"
         "  nbdtree-bench elements assets/gecko.obj --cage 200 --levels 2"},
        {"learned",
         "  nbdtree-bench learned beam.h5 poses.h5 -o learned.csv\n"
         "  nbdtree-bench learned beam.h5 poses.h5 --samples 16,32,0 --max-frames 500"},
        {"peers",
         "  nbdtree-bench peers poses.h5 --body beam.h5 tree.h5 -o peers\n"
         "  nbdtree-bench peers poses.h5 --body beam.h5 tree.h5 --contact light --methods 'affine,lazy "
         "boxes*' -o peers"},
        {"exactness",
         "  nbdtree-bench exactness beam.h5 --scenes 400 -o exactness.csv\n"
         "  nbdtree-bench exactness beam.h5 gear.h5 --scenes 100 --seed 2"},
        {"fig5",
         "  nbdtree-bench fig5 scene.h5 --body coarse.h5 coarse_tree.h5 --body fine.h5 fine_tree.h5 -o "
         "figure5\n"
         "  nbdtree-bench fig5 scene.h5 --body beam.h5 tree.h5 --bounds exact,nbd,affine -o figure5"},
        {"scaling",
         "  nbdtree-bench scaling poses.h5 --body beam.h5 tree.h5 -o scaling\n"
         "  nbdtree-bench scaling poses.h5 --body beam.h5 tree.h5 --bodies 2,8,32 -o scaling"},
        {"kernels",
         "  nbdtree-bench kernels tree.h5 poses.h5 -o kernels.csv\n"
         "  nbdtree-bench kernels tree.h5 poses.h5 --nodes 255"},
        {"networks",
         "  nbdtree-bench networks --body beam.h5 poses.h5 -o networks.csv\n"
         "  nbdtree-bench networks --body beam.h5 poses.h5 --body gear.h5 gear_poses.h5 -o networks.csv"},
        {"strengths",
         "  nbdtree-bench strengths --set tree.h5 poses.h5 -o strengths.csv\n"
         "  nbdtree-bench strengths --set weak_tree.h5 weak.h5 --set strong_tree.h5 strong.h5 -o "
         "strengths.csv"},
        {"contact",
         "  nbdtree-bench contact scene.json -o contact.csv\n"
         "  nbdtree-bench contact scene.json --seeds 10 --pictures pictures -o contact.csv"},
        {"impacts",
         "  nbdtree-bench impacts --random 1000000\n"
         "  nbdtree-bench impacts queries -o impacts.csv      # a folder of queries with exact answers"},
        {"physics",
         "  nbdtree-bench physics --quick\n"
         "  nbdtree-bench physics free_fall landing -o physics.csv"},
        {"self",
         "  nbdtree-bench self beam.h5 gear.h5 -o self.csv\n"
         "  nbdtree-bench self beam.h5 --scenes 60"},
    };
}

}  // namespace nbd

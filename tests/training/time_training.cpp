// Prints the CPU time of training per pose and node in microseconds: forward, backward and Adam, on one core.
// Arguments: poses epochs arithmetic. Run by compare_torch.py.
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string_view>

#include "training/networks/mlp_trainer.hpp"

int main(int argc, char** argv) {
    constexpr int nodes = 4;
    const int poses = argc > 1 ? std::atoi(argv[1]) : 4096, epochs = argc > 2 ? std::atoi(argv[2]) : 40;
    nbd::MlpConfig config{.patience = epochs, .max_epochs = epochs};
    if (argc > 3 && std::string_view(argv[3]) == "single") config.arithmetic = nbd::Arithmetic::single;
    const nbd::PoseRows inputs = nbd::PoseRows::Random(poses, 128), targets = nbd::PoseRows::Random(poses, 4);
    const std::clock_t start = std::clock();
    const nbd::PoseBlocks blocks(inputs, config.arithmetic, 1);
    for (int node = 0; node < nodes; ++node)
        if (nbd::train_mlp(blocks, targets, config, static_cast<std::uint64_t>(node))->epochs != epochs)
            return 1;
    const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    std::printf("%.4f\n", 1e6 * seconds / (static_cast<double>(poses) * epochs * nodes));
}

// Prints the microseconds of processor time that training takes a pose and node, forward, backward and Adam,
// on one core. Arguments: poses epochs. For compare_torch.py.
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "training/mlp_trainer.hpp"

int main(int argc, char** argv) {
    const int poses = argc > 1 ? std::atoi(argv[1]) : 4096, epochs = argc > 2 ? std::atoi(argv[2]) : 40;
    const nbd::PoseRows inputs = nbd::PoseRows::Random(poses, 128), targets = nbd::PoseRows::Random(poses, 4);
    const nbd::MlpConfig config{.patience = epochs, .max_epochs = epochs};
    const std::clock_t start = std::clock();
    const auto network = nbd::train_mlp(inputs, targets, config, 0);
    const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    if (network->epochs != epochs) return 1;
    std::printf("%.4f\n", 1e6 * seconds / (static_cast<double>(poses) * epochs));
}

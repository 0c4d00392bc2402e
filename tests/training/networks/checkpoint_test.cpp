#include "training/networks/checkpoint.hpp"

#include <gtest/gtest.h>

#include <sstream>

#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd {
namespace {

using Checkpoint = test::FileTest;

std::vector<TrainedMlp> half_trained() {
    std::vector<TrainedMlp> networks(5);
    for (const int i : {1, 4})
        networks[i] = {Eigen::VectorXf::Constant(9, 0.1f * static_cast<float>(i)),
                       0.01f * static_cast<float>(i), 10 * i};
    return networks;
}

TEST_F(Checkpoint, RoundTripsTrainedNetworks) {
    const auto path = folder / "checkpoint.h5", none = folder / "none.h5";
    const auto saved = half_trained();
    save_checkpoint(path, "key", saved);
    std::vector<TrainedMlp> loaded(5);
    EXPECT_EQ(load_checkpoint(path, "key", loaded), 2);
    for (std::size_t i = 0; i < 5; ++i) {
        EXPECT_EQ(loaded[i].weights, saved[i].weights);
        EXPECT_EQ(loaded[i].loss, saved[i].loss);
        EXPECT_EQ(loaded[i].epochs, saved[i].epochs);
    }
    EXPECT_EQ(load_checkpoint(none, "key", loaded), 0);
    save_checkpoint(none, "key", std::vector<TrainedMlp>(3));
    EXPECT_FALSE(std::filesystem::exists(none));
}

TEST_F(Checkpoint, IgnoresTheCheckpointOfAnotherTraining) {
    save_checkpoint(folder / "checkpoint.h5", "key", half_trained());
    std::vector<TrainedMlp> loaded(5);
    EXPECT_EQ(load_checkpoint(folder / "checkpoint.h5", "other key", loaded), 0);
    for (const TrainedMlp& network : loaded) EXPECT_EQ(network.weights.size(), 0);
}

TEST_F(Checkpoint, RejectsNodesThatTheTrainingDoesNotHave) {
    save_checkpoint(folder / "checkpoint.h5", "key", half_trained());
    std::vector<TrainedMlp> loaded(3);
    const std::string error =
        test::error_of([&] { load_checkpoint(folder / "checkpoint.h5", "key", loaded); });
    test::expect_clear(error, folder / "checkpoint.h5");
    EXPECT_NE(error.find("node 4"), std::string::npos);
}

TEST_F(Checkpoint, DetectsDamage) {
    save_checkpoint(folder / "checkpoint.h5", "key", half_trained());
    test::expect_damage_is_found(
        folder / "checkpoint.h5",
        [](const std::filesystem::path& path) {
            std::vector<TrainedMlp> networks(5);
            std::ostringstream text;
            text << load_checkpoint(path, "key", networks);
            for (const TrainedMlp& n : networks) text << ' ' << n.weights.sum() << ' ' << n.epochs;
            return text.str();
        },
        30, 60);
}

TEST(TrainingKey, ChangesWithDataAndOptions) {
    PoseRows inputs = PoseRows::Constant(6, 2, 0.5f), targets = PoseRows::Constant(6, 4, 0.25f);
    const std::string key = training_key(inputs, targets, {});
    EXPECT_EQ(key, training_key(inputs, targets, {}));
    EXPECT_NE(key, training_key(inputs, targets, {.seed = 2}));
    EXPECT_NE(key, training_key(inputs, targets, {.max_epochs = 7}));
    inputs(5, 1) = std::nextafter(0.5f, 1.f);
    EXPECT_NE(key, training_key(inputs, targets, {}));
}

}  // namespace
}  // namespace nbd

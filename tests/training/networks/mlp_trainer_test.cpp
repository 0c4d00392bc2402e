#include "training/networks/mlp_trainer.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <sstream>
#include <string>

#include "collision/base/counter_random.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/on_threads.hpp"
#include "training/networks/adam.hpp"
#include "training/networks/checkpoint.hpp"
#include "training/networks/pose_blocks.hpp"

namespace nbd {
namespace {

using Checkpoint = test::FileTest;

/// Poses of a smooth map from `m` numbers to four per node, with a different map for each node.
struct Problem {
    PoseRows inputs, targets;
    Problem(int poses, int m, int nodes, std::uint64_t seed) : inputs(poses, m), targets(poses, 4 * nodes) {
        for (int p = 0; p < poses; ++p) {
            for (int i = 0; i < m; ++i)
                inputs(p, i) = static_cast<float>(2 * counter_uniform(seed, p, i) - 1);
            for (int n = 0; n < nodes; ++n) {
                const float a = inputs(p, n % m), b = inputs(p, (n + 1) % m);
                targets.block<1, 4>(p, 4 * n) << a * b, std::abs(a), std::sin(2 * b), 0.5f * (a * a - b);
            }
        }
    }
};

MlpConfig quick() { return {.batch = 32, .min_learning_rate = 2e-4, .patience = 3, .max_epochs = 60}; }

std::vector<TrainedMlp> train(const Problem& data, const MlpConfig& config) {
    std::vector<TrainedMlp> networks(static_cast<std::size_t>(data.targets.cols() / 4));
    train_mlps(data.inputs, data.targets, config, {}, {}, networks);
    return networks;
}

void expect_same(const std::vector<TrainedMlp>& a, const std::vector<TrainedMlp>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        EXPECT_EQ(a[i].weights, b[i].weights) << "node " << i;
        EXPECT_EQ(a[i].loss, b[i].loss) << "node " << i;
        EXPECT_EQ(a[i].epochs, b[i].epochs) << "node " << i;
    }
}

/// Message of the error that training with `config` throws.
std::string error_of(const MlpConfig& config) {
    return test::refusal([&] { train(Problem(8, 2, 1, 1), config); });
}

TEST(MlpTrainer, LearnsAKnownFunctionAndGeneralises) {
    const Problem data(2000, 4, 1, 1), fresh(500, 4, 1, 2);
    const MlpConfig config{.batch = 64, .max_epochs = 120};
    const auto network = train_mlp(PoseBlocks(data.inputs, config.arithmetic, 1), data.targets, config, 0);
    ASSERT_TRUE(network);
    EXPECT_LT(network->loss, 1e-3);

    const PoseBlocks poses(fresh.inputs, Arithmetic::single, 1);
    std::vector<int> blocks(poses.blocks());
    std::iota(blocks.begin(), blocks.end(), 0);
    EXPECT_LT(MlpBatch(32, poses, fresh.targets, poses.blocks()).loss(network->weights, blocks), 3e-3f);
    // The targets are large enough for the bounds above to be meaningful.
    EXPECT_GT(fresh.targets.squaredNorm() / static_cast<float>(fresh.targets.size()), 0.1f);
}

/// Weights after two epochs of steps over one block each, by definition; with one order for both epochs, or
/// another one for each.
Eigen::VectorXf two_epochs(const Problem& data, const MlpConfig& config, bool shuffled_anew) {
    const PoseBlocks poses(data.inputs, config.arithmetic, 1);
    std::vector<int> order(poses.blocks());
    std::iota(order.begin(), order.end(), 0);
    MlpBatch batch(config.hidden, poses, data.targets, 1);
    Eigen::VectorXf weights = initial_weights(batch.shape(), config.seed, 0), gradient(weights.size());
    Adam adam(weights.size(), config.weight_decay);
    for (int epoch = 0; epoch < 2; ++epoch) {
        if (epoch == 0 || shuffled_anew) shuffle(order, config.seed, 0, epoch);
        for (const int block : order) {
            batch.loss_and_gradient(weights, std::span(&block, 1), gradient);
            adam.step(gradient, config.learning_rate, weights);
        }
    }
    return weights;
}

TEST(MlpTrainer, SeesThePosesInAnotherOrderInEveryEpoch) {
    const Problem data(12 * PoseBlocks::block, 4, 1, 1);
    const MlpConfig config{.batch = PoseBlocks::block, .max_epochs = 2, .arithmetic = Arithmetic::single};
    const auto network = train_mlp(PoseBlocks(data.inputs, config.arithmetic, 1), data.targets, config, 0);
    ASSERT_TRUE(network);
    EXPECT_EQ(network->epochs, 2);
    EXPECT_EQ(network->weights, two_epochs(data, config, true));
    EXPECT_NE(network->weights, two_epochs(data, config, false));
}

TEST(MlpTrainer, StopsBeforeTheEpochLimitWhenTheLossStalls) {
    Problem data(200, 3, 1, 1);
    data.targets.setZero();
    const auto network = train_mlp(PoseBlocks(data.inputs, Arithmetic::single, 1), data.targets,
                                   {.batch = 50, .improvement = 0.5, .max_epochs = 5000}, 0);
    EXPECT_LT(network->epochs, 1000);
    EXPECT_LT(network->loss, 1e-3);
}

TEST(MlpTrainer, GivesTheSameBitsOnAnyNumberOfThreads) {
    const Problem data(150, 6, 7, 3);
    const auto run = [&] { return train(data, quick()); };
    const auto one = test::on_threads(1, run);
    EXPECT_NE(one[0].weights, one[1].weights);
    expect_same(one, test::on_threads(2, run));
}

TEST(MlpTrainer, GivesTheSameBitsWhenStoppedAndResumed) {
    const Problem data(150, 6, 7, 3);
    const auto expected = train(data, quick());

    std::vector<TrainedMlp> networks(7);
    std::atomic<bool> cancel = false;
    int calls = 0;
    const TrainingHooks hooks{.progress = [&](const TrainingProgress& p) { cancel = p.nodes_done >= 3; },
                              .cancel = [&] { return cancel.load(); }};
    const auto stopped = [&] {
        train_mlps(
            data.inputs, data.targets, quick(), hooks, [&] { ++calls; }, networks);
    };
    EXPECT_THROW(test::on_threads(2, stopped), TrainingCancelled);
    EXPECT_GE(calls, 3);
    EXPECT_LT(calls, 7);

    train_mlps(
        data.inputs, data.targets, quick(), {}, [&] { ++calls; }, networks);
    EXPECT_EQ(calls, 7);
    expect_same(expected, networks);
}

TEST(MlpTrainer, ReportsProgressUntilTheLastNode) {
    const Problem data(40, 2, 3, 3);
    std::vector<TrainedMlp> networks(3);
    std::vector<TrainingProgress> seen;
    train_mlps(data.inputs, data.targets, quick(),
               {.progress = [&](const TrainingProgress& p) { seen.push_back(p); }}, {}, networks);
    ASSERT_EQ(seen.size(), 3u);
    EXPECT_EQ(seen.front().nodes_done, 1);
    EXPECT_GT(seen.front().seconds_left, 0);
    EXPECT_EQ(seen.back().nodes_done, 3);
    EXPECT_EQ(seen.back().seconds_left, 0);
    EXPECT_GT(seen.back().mean_loss, 0);
}

TEST(MlpTrainer, NamesTheOptionThatIsOutOfRange) {
    EXPECT_EQ(error_of({.hidden = 20}), "hidden layers of 20 neurons; allowed: 16, 32 and 64");
    EXPECT_EQ(error_of({.batch = 0}), "batch of 0 poses, at least 1 needed");
    EXPECT_EQ(error_of({.learning_rate = -1}), "learning rate -1; allowed: (0, 1]");
    EXPECT_EQ(error_of({.min_learning_rate = 1}), "lowest learning rate 1; allowed: (0, 0.005]");
    EXPECT_EQ(error_of({.weight_decay = -1}), "weight decay -1; allowed: [0, 1]");
    EXPECT_EQ(error_of({.decay = 1}), "learning rate decay 1; allowed: (0, 1)");
    EXPECT_EQ(error_of({.patience = -1}), "patience of -1 epochs, at least 0 needed");
    EXPECT_EQ(error_of({.improvement = 1}), "improvement 1; allowed: [0, 1)");
    EXPECT_EQ(error_of({.max_epochs = 0}), "epoch limit 0, at least 1 needed");
}

TEST(MlpTrainer, RejectsDataOfTheWrongShape) {
    std::vector<TrainedMlp> networks(2);
    EXPECT_THROW(train_mlps(PoseRows(5, 3), PoseRows(4, 8), {}, {}, {}, networks), std::invalid_argument);
    EXPECT_THROW(train_mlps(PoseRows(5, 3), PoseRows(5, 4), {}, {}, {}, networks), std::invalid_argument);
    EXPECT_THROW(train_mlps(PoseRows(0, 3), PoseRows(0, 8), {}, {}, {}, networks), std::invalid_argument);
    networks[1].weights.setZero(17);
    EXPECT_THROW(train_mlps(PoseRows(5, 3), PoseRows(5, 8), {}, {}, {}, networks), std::invalid_argument);
}

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

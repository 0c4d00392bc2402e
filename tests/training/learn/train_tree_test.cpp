#include "training/learn/train_tree.hpp"

#include <gtest/gtest.h>

#include "collision/nbd_tree/nbd_bound.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/on_threads.hpp"
#include "tests/training/bar.hpp"
#include "training/calibrate/calibrate.hpp"

namespace nbd {
namespace {

using test::Bar;
using test::error_of;

class TrainTree : public test::FileTest {
 protected:
    RecordingReader recording(int trajectories = 8, int frames = 60) {
        bar.record(folder / "data.h5", trajectories, frames, 2);
        return RecordingReader(folder / "data.h5");
    }
    static TrainConfig quick() {
        return {.tree = {.depth = 2},
                .clusters = {.k_means = {.clusters = 40}, .initialisations = 2, .poses = 50},
                .held_out_share = 0.25,
                .mlp = {.batch = 32, .max_epochs = 20}};
    }
    Bar bar{12, 3};
};

void expect_same(const TreeFile& a, const TreeFile& b) {
    EXPECT_EQ(a.tree.nbd->networks.weights(), b.tree.nbd->networks.weights());
    EXPECT_EQ(a.tree.nbd->modes.representatives, b.tree.nbd->modes.representatives);
    EXPECT_EQ(a.tree.nbd->z_centre, b.tree.nbd->z_centre);
    EXPECT_EQ(a.tree.nbd->out_scale, b.tree.nbd->out_scale);
    EXPECT_EQ(a.tree.learned_affine->fit().samples, b.tree.learned_affine->fit().samples);
    EXPECT_EQ(a.tree.learned_affine->fit().growth, b.tree.learned_affine->fit().growth);
    EXPECT_EQ(a.facts.node_loss, b.facts.node_loss);
    EXPECT_EQ(a.facts.z_error, b.facts.z_error);
}

TEST_F(TrainTree, GivesConsistentModelsAndTrainingFacts) {
    const auto data = recording();
    std::vector<std::string> stages;
    const TreeFile file = train_tree(bar.body, data, quick(),
                                     {.stage = [&](std::string_view name) { stages.emplace_back(name); }});
    EXPECT_NO_THROW(check_sphere_tree(file.tree.spheres, file.tree.vertex_count, file.tree.faces));
    ASSERT_TRUE(file.tree.bd && file.tree.nbd && file.tree.learned_affine);
    EXPECT_NO_THROW(check_bd_model(*file.tree.bd, file.tree.spheres, file.tree.vertex_count));
    EXPECT_NO_THROW(check_nbd_model(*file.tree.nbd, file.tree.spheres, file.tree.vertex_count));
    EXPECT_EQ(file.tree.spheres.nodes.size(), 7u);
    EXPECT_EQ(file.facts.body_hash, bar.body.hash);
    EXPECT_EQ(file.facts.recording_hash.size(), 64u);
    EXPECT_EQ(file.facts.split.held_out_trajectories.size(), 2u);
    EXPECT_EQ(file.facts.poses, static_cast<int>(frames_of(data, file.facts.split, FrameSet::train).size()));
    EXPECT_NE(file.facts.config.find("\"representatives\":40"), std::string::npos);
    EXPECT_LT(file.facts.node_loss.maxCoeff(), 0.05f);
    EXPECT_GT(file.facts.z_error, 0);
    EXPECT_EQ(stages,
              (std::vector<std::string>{"reading", "fitting learned affine bounds", "clustering modes",
                                        "computing labels", "training networks"}));
}

TEST_F(TrainTree, GivesTheSameBitsOnAnyNumberOfThreads) {
    const auto data = recording();
    const auto run = [&] { return train_tree(bar.body, data, quick()); };
    expect_same(test::on_threads(1, run), test::on_threads(2, run));
}

TEST_F(TrainTree, ReadsTheRecordingOnceAndGivesTheSameBitsAsWhenItIsStreamed) {
    recording(16, 60);
    struct Run {
        TreeFile file;
        double reads;
    };
    const auto run = [&](std::size_t memory, int threads) {
        const RecordingReader data(folder / "data.h5");
        FrameSource source(bar.body.W, data, memory);
        return test::on_threads(threads, [&] {
            Run run{train_tree(bar.body, source, quick()), 0};
            calibrate(run.file, source, {.miss_rate = 0.05});
            run.reads = static_cast<double>(data.frames_read()) / data.frames();
            return run;
        });
    };
    const Run kept = run(std::size_t{1} << 30, 2), streamed = run(0, 2), part = run(50'000, 1);
    EXPECT_EQ(kept.reads, 1);
    EXPECT_GT(streamed.reads, 5);
    EXPECT_GT(part.reads, 1);
    EXPECT_LT(part.reads, streamed.reads);
    for (const Run* other : {&streamed, &part}) {
        expect_same(kept.file, other->file);
        EXPECT_EQ(kept.file.facts.recording_hash, other->file.facts.recording_hash);
        EXPECT_EQ(kept.file.tree.nbd->z_mean, other->file.tree.nbd->z_mean);
        EXPECT_EQ(kept.file.tree.nbd->z_whitening, other->file.tree.nbd->z_whitening);
        ASSERT_EQ(kept.file.tree.calibrations.size(), 3u);
        for (const auto& [kind, calibration] : kept.file.tree.calibrations) {
            EXPECT_EQ(calibration.margins, other->file.tree.calibrations.at(kind).margins) << name(kind);
            EXPECT_EQ(calibration.limits, other->file.tree.calibrations.at(kind).limits) << name(kind);
        }
    }
}

TEST_F(TrainTree, GivesTheSameBitsAfterResumingFromACheckpoint) {
    const auto data = recording();
    const auto checkpoint = folder / "checkpoint.h5";
    std::atomic<bool> cancel = false;
    TrainRun run{.hooks = {.progress = [&](const TrainingProgress& p) { cancel = p.nodes_done >= 3; },
                           .cancel = [&] { return cancel.load(); }},
                 .checkpoint = checkpoint};
    EXPECT_THROW(train_tree(bar.body, data, quick(), run), TrainingCancelled);
    ASSERT_TRUE(std::filesystem::exists(checkpoint));

    int trained = 0;
    run.hooks = {.progress = [&](const TrainingProgress&) { ++trained; }};
    const TreeFile resumed = train_tree(bar.body, data, quick(), run);
    EXPECT_LT(trained, 5);
    expect_same(resumed, train_tree(bar.body, data, quick()));
}

TEST_F(TrainTree, TrainsOnlyTheRequestedBounds) {
    const auto data = recording();
    const TreeFile both = train_tree(bar.body, data, quick());
    TrainConfig config = quick();
    config.bounds = {BoundKind::nbd};
    const TreeFile nbd = train_tree(bar.body, data, config);
    EXPECT_TRUE(nbd.tree.bd && nbd.tree.nbd && !nbd.tree.learned_affine);
    EXPECT_EQ(nbd.tree.nbd->networks.weights(), both.tree.nbd->networks.weights());
    config.bounds = {BoundKind::learned_affine};
    SurfaceBody without_modes = bar.body;
    without_modes.U.resize(without_modes.U.rows(), 0);
    const TreeFile learned = train_tree(without_modes, data, config);
    EXPECT_TRUE(!learned.tree.bd && !learned.tree.nbd && learned.tree.learned_affine);
    const auto growth = [](const TreeFile& file) { return file.tree.learned_affine->fit().growth; };
    EXPECT_EQ(growth(learned), growth(both));
    save_tree(folder / "learned.h5", learned);
    EXPECT_EQ(growth(load_tree(folder / "learned.h5")), growth(learned));
}

TEST_F(TrainTree, TrainsTheNetworksOfThePaper) {
    const auto data = recording();
    TrainConfig config = quick();
    config.bounds = {BoundKind::nbd};
    const TreeFile ours = train_tree(bar.body, data, config);
    use_paper_networks(config);
    const TreeFile paper = train_tree(bar.body, data, config);
    EXPECT_EQ(ours.tree.nbd->networks.numbers(), NetworkNumbers::bytes);
    EXPECT_GT(ours.tree.nbd->centre_map.size(), 0);
    EXPECT_EQ(paper.tree.nbd->networks.numbers(), NetworkNumbers::floats);
    EXPECT_EQ(paper.tree.nbd->centre_map.size(), 0);
    for (const char* option : {"\"label_frame\":\"full\"", "\"linear_centre\":false", "\"weight_decay\":0.0",
                               "\"arithmetic\":\"single\"", "\"network_numbers\":\"floats\""}) {
        EXPECT_NE(paper.facts.config.find(option), std::string::npos) << option;
        EXPECT_EQ(ours.facts.config.find(option) != std::string::npos,
                  std::string_view(option).find("arithmetic") != std::string_view::npos &&
                      !has_arithmetic(Arithmetic::mixed))
            << option;
    }
    EXPECT_LT(paper.facts.node_loss.maxCoeff(), 0.05f);
}

TEST_F(TrainTree, UsesTheLowestModesOfTheBody) {
    TrainConfig config = quick();
    config.modes = 5;
    const TreeFile file = train_tree(bar.body, recording(), config);
    EXPECT_EQ(file.tree.nbd->mode_count(), 5);
    const int v = file.tree.nbd->modes.representatives[0];
    const Eigen::MatrixXf U = bar.body.U.block(3 * v, 0, 3, 5);
    EXPECT_TRUE(file.tree.nbd->modes.U.numbers().topRows(3).isApprox(U, 1e-3f));
    EXPECT_NE(file.facts.config.find("\"modes\":5,"), std::string::npos);
}

TEST(DefaultDepth, IsThePapersForItsNetworksAndFollowsTheFacesElse) {
    const BoundKind with_nbd[] = {BoundKind::learned_affine, BoundKind::nbd},
                    without[] = {BoundKind::learned_affine};
    EXPECT_EQ(default_depth(with_nbd, 871'306), 7);
    EXPECT_EQ(default_depth(without, 100), 7);
    EXPECT_EQ(default_depth(without, 600 * 128 + 127), 7);
    EXPECT_EQ(default_depth(without, 600 * 128 + 128), 8);
    EXPECT_EQ(default_depth(without, 871'306), 11);
    EXPECT_EQ(default_depth(without, 1'000'000'000), 16);
}

TEST_F(TrainTree, RejectsTooFewPosesAndInvalidOptions) {
    const auto data = recording(2, 10);
    const auto error = [&](auto change) {
        TrainConfig config = quick();
        change(config);
        return error_of([&] { train_tree(bar.body, data, config); });
    };
    EXPECT_NE(error([](auto&) {}).find("training poses; allowed: at least 32"), std::string::npos);
    EXPECT_EQ(error([](auto& c) { c.modes = 0; }), "0 modes; allowed: 1 to 1024");
    EXPECT_EQ(error([](auto& c) { c.modes = 1025; }), "1025 modes; allowed: 1 to 1024");
    EXPECT_EQ(error([](auto& c) { c.bounds = {}; }), "no bounds to train; allowed: nbd, learned_affine");
    EXPECT_EQ(error([](auto& c) { c.bounds = {BoundKind::bd}; }),
              "bd bounds are not trained; allowed: nbd, learned_affine");
    EXPECT_EQ(error([](auto& c) { c.learned_affine.box_miss_rate = 1; }),
              "miss rate of boxes 1; allowed: [0, 1)");
    EXPECT_EQ(error([](auto& c) { c.held_out_share = 2; }),
              "share of held-out trajectories 2; allowed: [0, 1)");
    EXPECT_EQ(error([](auto& c) { c.mlp.hidden = 7; }), "hidden layers of 7 neurons; allowed: 16, 32 and 64");
}

TEST_F(TrainTree, RejectsAnotherBodysRecordingAndABodyWithoutModes) {
    const auto data = recording(2, 40);
    SurfaceBody other = bar.body;
    other.hash = std::string(64, 'c');
    EXPECT_NE(error_of([&] { train_tree(other, data, quick()); }).find("but this body is cccc"),
              std::string::npos);
    other = bar.body;
    other.U.resize(other.U.rows(), 0);
    EXPECT_EQ(error_of([&] { train_tree(other, data, quick()); }),
              "the body has no modes; run `nbdtree modes` first");
}

}  // namespace
}  // namespace nbd

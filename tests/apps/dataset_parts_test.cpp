// Tests the parts of dataset generation without the command.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <cstdlib>
#include <stdexcept>

#include "apps/cli/rank.hpp"
#include "apps/dataset/card.hpp"
#include "apps/dataset/claims.hpp"
#include "apps/dataset/plan.hpp"
#include "apps/dataset/shard_folder.hpp"
#include "apps/dataset/variety.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/failing_reads.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/on_threads.hpp"
#include "training/files/recording_format.hpp"

namespace nbd {
namespace {

using DatasetParts = test::FileTest;

TEST(DatasetCard, SaysWhatIsInTheDataset) {
    const Body body = test::box_body({1, 1, 1}, {2, 2, 2});
    DatasetPlan plan;
    plan.excitation.seed = 77;
    Variety variety;
    variety.kinds["drop"] = {.trajectories = 9, .failed = 2, .frames = 321, .frames_in_contact = 45};
    variety.all = variety.kinds["drop"];
    variety.body_length = 1;
    DatasetManifest manifest;
    manifest.plan = plan_json(plan, body);
    manifest.variety = to_json(variety);
    manifest.train_trajectories = {0, 1, 2, 3, 4};
    manifest.held_out_trajectories = {5, 6};
    const auto card = [&](const std::string& licence) {
        return dataset_card("poses.h5", body, "box.h5", licence, manifest);
    };
    for (const std::string& text :
         {std::string("# poses.h5\n"), std::string("`box.h5`, 27 nodes"), std::string("Licence: CC0-1.0"),
          body_hash(body), std::string("drop                  9       2     321 "),
          std::string("5 are to train on, 2 are held out"), std::string("the seed 77 ")})
        EXPECT_NE(card("CC0-1.0").find(text), std::string::npos) << text << "\n" << card("CC0-1.0");
    EXPECT_NE(card("").find("Licence: not stated"), std::string::npos);
}

TEST_F(DatasetParts, AClaimBelongsToOneProcessUntilItEnds) {
    const Claims claims(folder / "claims"), others(folder / "claims");  // stand for two processes
    {
        const auto held = claims.try_claim(7);
        EXPECT_TRUE(held);
        EXPECT_FALSE(others.try_claim(7));
        EXPECT_TRUE(others.try_claim(8));
    }
    EXPECT_TRUE(others.try_claim(7));

    int ready[2];
    ASSERT_EQ(pipe(ready), 0);
    const pid_t child = fork();
    if (child == 0) {
        const Claims own(folder / "claims");
        const auto held = own.try_claim(3);
        const char byte = held ? 'y' : 'n';
        if (write(ready[1], &byte, 1) != 1) _exit(1);
        pause();
    }
    char byte = 0;
    ASSERT_EQ(read(ready[0], &byte, 1), 1);
    EXPECT_EQ(byte, 'y');
    EXPECT_FALSE(claims.try_claim(3));
    kill(child, SIGKILL);
    int waited = 0;
    const auto taken_over = claims.wait_for(3, [&] { ++waited; });
    EXPECT_TRUE(taken_over);
    waitpid(child, nullptr, 0);
    EXPECT_THROW(others.wait_for(3, [] { throw std::runtime_error("enough"); }), std::runtime_error);
}

TEST_F(DatasetParts, ShardsCoverAllTrajectoriesOnce) {
    const ShardFolder files("some/data.h5", 10, 4);
    EXPECT_EQ(files.path(), "some/data.shards");
    ASSERT_EQ(files.shards(), 3);
    EXPECT_EQ(files.shard_name(2), "000008-000009.h5");
    EXPECT_EQ(files.relative(1), "data.shards/000004-000007.h5");
    for (int i = 0; i < 10; ++i) {
        const int shard = files.shard_of(i);
        EXPECT_TRUE(files.first(shard) <= i && i < files.end(shard)) << i;
    }
    EXPECT_EQ(files.count(), 0);
}

TEST_F(DatasetParts, AShardThatCannotBeReadIsNotCalledDefective) {
    const auto path = folder / "shard.h5";
    RecordingWriter shard(path);
    shard.label(dataset_label, "a key");
    const int handle = shard.begin_trajectory({5, 1, std::string(64, 'a'), "{}", "", 0}, 3);
    shard.add_frame(handle, 0.1, Vertices::Ones(3, 3));
    shard.end_trajectory(handle, "");
    shard.finish();
    const int failed =
        test::with_each_read_failing(path, [&] { EXPECT_EQ(shard_defect(path, "a key", 5, 6), ""); });
    EXPECT_GT(failed, 4);
}

TEST_F(DatasetParts, PlansDifferWhenTheirTrajectoriesWould) {
    const Body body = test::box_body({1, 0.3, 0.25}, {4, 1, 1});
    const std::string plan = plan_json({}, body);
    EXPECT_EQ(plan_difference(plan, plan), "");
    EXPECT_EQ(plan_key(plan).size(), 64u);
    const auto difference = [&](auto change) {
        DatasetPlan other;
        Body other_body = body;
        change(other, other_body);
        const std::string text = plan_json(other, other_body);
        EXPECT_NE(plan_key(text), plan_key(plan));
        return plan_difference(plan, text);
    };
    EXPECT_EQ(difference([](auto& p, auto&) { p.excitation.frames = 60; }), "frames 50, not 60");
    EXPECT_EQ(difference([](auto& p, auto&) { p.excitation.ranges.force.strain.to = 0.5; }),
              "recipe.force.strain.to 0.6, not 0.5");
    EXPECT_EQ(difference([](auto& p, auto&) { p.excitation.ranges.contact_share = 0.5; }),
              "recipe.contact_share none, not 0.5");
    EXPECT_EQ(difference([](auto&, auto& b) { b.material.young = 2e5; }),
              "material.young 100000.0, not 200000.0");
    EXPECT_EQ(difference([](auto&, auto& b) { b.tets.X *= 2; }).rfind("body_sha256 ", 0), 0u);
}

TEST(Rank, FollowsTheEnvironmentOfTheLauncher) {
    for (const char* name : {"OMPI_COMM_WORLD_RANK", "PMI_RANK", "SLURM_PROCID"}) unsetenv(name);
    EXPECT_EQ(this_rank().count, 1);
    setenv("SLURM_PROCID", "3", 1);
    setenv("SLURM_STEP_NUM_TASKS", "5", 1);
    EXPECT_EQ(this_rank().number, 3);
    EXPECT_EQ(this_rank().count, 5);
    setenv("OMPI_COMM_WORLD_RANK", "1", 1);
    setenv("OMPI_COMM_WORLD_SIZE", "4", 1);
    setenv("OMPI_COMM_WORLD_LOCAL_SIZE", "2", 1);
    EXPECT_EQ(this_rank().number, 1);
    EXPECT_EQ(this_rank().count, 4);
    EXPECT_EQ(this_rank().on_this_machine, 2);
    setenv("OMPI_COMM_WORLD_RANK", "many", 1);
    setenv("SLURM_PROCID", "5", 1);  // out of range: there are 5
    EXPECT_EQ(this_rank().count, 1);
}

/// A bar with two M-orthonormal "modes": stretch along x and shear of y along x.
class VarietyTest : public test::FileTest {
 protected:
    VarietyTest() : body_(test::box_body({1, 0.3, 0.25}, {6, 2, 2})) {
        const Nodes& X = body_.tets.X;
        Nodes stretch = Nodes::Zero(X.rows(), 3), shear = stretch;
        stretch.col(0) = X.col(0);
        shear.col(1) = X.col(0);
        body_.modes.frequencies.resize(2);
        body_.modes.frequencies << 3, 5;
        body_.modes.U.resize(X.size(), 2);
        Eigen::VectorXd masses = Eigen::VectorXd::Zero(X.rows());
        for (Eigen::Index t = 0; t < body_.tets.T.rows(); ++t) {
            Eigen::Matrix3d E;
            for (int k = 0; k < 3; ++k)
                E.col(k) = (X.row(body_.tets.T(t, k + 1)) - X.row(body_.tets.T(t, 0))).transpose();
            for (int k = 0; k < 4; ++k) masses[body_.tets.T(t, k)] += 1000 * E.determinant() / 24;
        }
        const double norm = std::sqrt(masses.dot(X.col(0).cwiseAbs2()));
        root_mean_square_ = norm / std::sqrt(masses.sum());
        body_.modes.U.col(0) = (stretch / norm).reshaped<Eigen::RowMajor>().cast<float>();
        body_.modes.U.col(1) = (shear / norm).reshaped<Eigen::RowMajor>().cast<float>();
    }

    /// Records frames stretched by the given factors along x and moved rigidly.
    std::filesystem::path record(const std::vector<double>& stretches, const std::string& failure = {}) {
        RecordingWriter file(folder / "data.h5");
        const int nodes = body_.tets.X.rows();
        const int handle =
            file.begin_trajectory({0, 1, body_hash(body_), R"({"kind": "free"})", "", 0}, nodes);
        std::vector<std::int32_t> contacts;
        for (const double stretch : stretches) {
            Nodes x = body_.tets.X;
            x.col(0) *= stretch;
            const Eigen::AngleAxisd turn(1.0 + stretch, Eigen::Vector3d(1, 2, 3).normalized());
            x = (x * turn.toRotationMatrix().transpose()).rowwise() + Eigen::RowVector3d(5, -2, 7);
            file.add_frame(handle, static_cast<double>(contacts.size()), x.cast<float>());
            contacts.push_back(stretch > 1 ? 2 : 0);
        }
        file.end_trajectory(handle, failure, {.contacts = contacts});
        file.finish();
        return folder / "data.h5";
    }

    Body body_;
    double root_mean_square_;  // of x, weighted by the bar's mass
};

TEST_F(VarietyTest, MeasuresStretchAndModalSpreadUnderRigidMotion) {
    VarietyMeter meter(body_, 4);
    meter.add(RecordingReader(record({0.8, 1.2, 0.8, 1.2})));
    const Variety variety = meter.report();
    EXPECT_EQ(variety.sampled, 4);
    EXPECT_EQ(variety.all.frames, 4);
    EXPECT_EQ(variety.all.frames_in_contact, 2);
    EXPECT_EQ(variety.kinds.at("free").trajectories, 1);
    EXPECT_NEAR(variety.least_stretch, 0.8, 1e-4);
    EXPECT_NEAR(variety.largest_stretch, 1.2, 1e-4);
    ASSERT_EQ(variety.stretch.size(), 5u);
    EXPECT_NEAR(variety.stretch[1], 0.8, 1e-3);  // a sixth of the stretches are 0.8, a sixth 1.2
    EXPECT_NEAR(variety.stretch[2], 1, 1e-3);
    EXPECT_NEAR(variety.stretch[3], 1.2, 1.5e-3);
    // The mesh is not quite symmetric, so the best rotation differs slightly from the one applied.
    EXPECT_NEAR(variety.displacement, 0.2 * root_mean_square_, 1e-4);
    EXPECT_NEAR(variety.mode_std[0], 0.2 * root_mean_square_, 1e-4);
    EXPECT_LT(variety.mode_std[1], 0.03 * variety.mode_std[0]);
    EXPECT_NEAR(variety.mode_share[0], 1, 2e-3);

    const Variety again = variety_from_json(to_json(variety));
    EXPECT_EQ(to_json(again), to_json(variety));
    EXPECT_NE(to_text(again).find(
                  "all                   1       0       4      50.0 %       0.0 %              0.0 %"),
              std::string::npos);
    EXPECT_EQ(test::refusal([] { variety_from_json("[1]"); }).empty(), false);
}

TEST_F(VarietyTest, CountsFailedTrajectoriesWithoutMeasuringThem) {
    VarietyMeter meter(body_, 4);
    meter.add(RecordingReader(record({0.8, 1.2}, "it burst")));
    const Variety variety = meter.report();
    EXPECT_EQ(variety.kinds.at("free").failed, 1);
    EXPECT_EQ(variety.all.frames, 0);
    EXPECT_EQ(variety.sampled, 0);
    EXPECT_TRUE(variety.stretch.empty());
    EXPECT_FALSE(to_text(variety).empty());
}

TEST_F(VarietyTest, GivesTheSameResultOnAnyNumberOfThreadsAndSamplesEvenly) {
    std::vector<double> stretches;
    for (int i = 0; i < 40; ++i) stretches.push_back(1 + 0.01 * i);
    const auto path = record(stretches);
    const auto report = [&] {
        VarietyMeter meter(body_, 10'000);
        meter.add(RecordingReader(path));
        return to_json(meter.report());
    };
    const std::string one = test::on_threads(1, report), four = test::on_threads(4, report);
    EXPECT_EQ(one, four);
    EXPECT_EQ(variety_from_json(one).sampled, 4);
}

}  // namespace
}  // namespace nbd

// Networks survive the export to PyTorch and the import back.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <random>

#include "collision/tree/posed_tree.hpp"
#include "meshing/h5/writer.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/shapes.hpp"
#include "tests/training/bar.hpp"
#include "tests/training/example_tree.hpp"
#include "training/evaluate/evaluate.hpp"
#include "training/learn/torch_file.hpp"
#include "training/learn/train_tree.hpp"

namespace nbd {
namespace {

class TorchTest : public test::FileTest {
 protected:
    void SetUp() override {
        if (std::system("/usr/bin/python3 -c 'import torch, h5py' 2>/dev/null") != 0)
            GTEST_SKIP() << "/usr/bin/python3 has no torch and h5py (Debian: python3-torch, python3-h5py)";
    }

    /// Runs a Python script with paths relative to the folder.
    void python(const std::string& script, const std::string& arguments) const {
        const std::string command =
            fmt::format("cd '{}' && OMP_NUM_THREADS=1 /usr/bin/python3 '{}' {} >log 2>&1", folder.string(),
                        script, arguments);
        EXPECT_EQ(std::system(command.c_str()), 0) << test::read_bytes(folder / "log");
    }
};

TEST_F(TorchTest, ExportedNetworksGiveTheSameSpheres) {
    TreeFile file = test::example_tree({});
    // Representatives at their vertices make the rotation well determined.
    for (std::size_t i = 0; i < file.tree.nbd->modes.representatives.size(); ++i)
        file.tree.nbd->modes.X.row(static_cast<Eigen::Index>(i)) =
            file.X.row(file.tree.nbd->modes.representatives[i]);
    save_torch(folder / "torch.h5", file);
    const auto tree = std::make_shared<const CollisionTree>(file.tree);
    PosedTree posed(tree, BoundKind::nbd, 0.f);  // no margins: only the networks
    constexpr int poses = 7;
    const auto nodes = static_cast<Eigen::Index>(tree->spheres.nodes.size());
    PoseRows x(poses, 3 * file.X.rows()), spheres(poses, 4 * nodes);
    std::mt19937 random(4);
    for (int p = 0; p < poses; ++p) {
        const Vertices pose =
            shapes::moved(shapes::wobbled(file.X, random, 0.2f), shapes::random_motion(random, 2));
        x.row(p) = pose.reshaped<Eigen::RowMajor>().transpose();
        posed.begin_pose(pose);
        for (int i = 0; i < nodes; ++i)
            spheres.row(p).segment<4>(4 * i) << posed.sphere(i).c.transpose(), posed.sphere(i).r;
    }
    h5::Writer out(folder / "poses.h5", {"nbdtree test", 1});
    out.write("x", x);
    out.write("spheres", spheres);
    out.commit();
    python(NBD_CHECK_TORCH, fmt::format("'{}' torch.h5 poses.h5", NBD_TORCH));
}

TEST_F(TorchTest, ExportRejectsATreeWithoutNetworks) {
    TreeFile file = test::example_tree({});
    file.tree.nbd.reset();
    const std::string error = test::error_of([&] { save_torch(folder / "torch.h5", file); });
    EXPECT_NE(error.find("no networks to export"), std::string::npos) << error;
    EXPECT_FALSE(std::filesystem::exists(folder / "torch.h5"));
}

/// Mean radius error on the held-out trajectories over all depths.
double radius_error(const TreeFile& file, const RecordingReader& recording) {
    double sum = 0;
    int rows = 0;
    for (const EvaluationRow& row : evaluate(file, recording, {.bounds = {BoundKind::nbd}, .margins = {0}}))
        if (row.frames == "held-out trajectories") {
            sum += row.radius_error;
            ++rows;
        }
    return sum / rows;
}

TEST_F(TorchTest, TheTrainingScriptImprovesATreeThatStillLoads) {
    const test::Bar bar(8);
    bar.record(folder / "data.h5", 10, 40, 3);
    const RecordingReader recording(folder / "data.h5");
    TrainConfig config;
    config.tree.depth = 2;
    config.clusters.k_means.clusters = 24;
    config.mlp.max_epochs = 1;
    TreeFile begun = train_tree(bar.body, recording, config);
    const double error_before = radius_error(begun, recording);
    const auto nodes = begun.tree.spheres.nodes.size();
    begun.tree.calibrations[BoundKind::nbd] = {.miss_rate = 0.1,
                                               .confidence = 0.9,
                                               .trajectories = 3,
                                               .poses = 9,
                                               .margins = std::vector<float>(nodes, 0.1f),
                                               .limits = std::vector<float>(nodes, 1.f)};
    save_tree(folder / "begun.h5", begun);
    python(NBD_TORCH "/train.py", "begun.h5 data.h5 -o trained.h5 --epochs 120 --device cpu");
    const TreeFile trained = load_tree(folder / "trained.h5");
    EXPECT_TRUE(trained.tree.calibrations.empty());     // calibrations of the old networks are dropped
    EXPECT_EQ(trained.facts.poses, begun.facts.poses);  // the same frames are held out
    EXPECT_EQ(trained.tree.bd->modes.U, begun.tree.bd->modes.U);
    const NbdModel &ours = *begun.tree.nbd, &theirs = *trained.tree.nbd;
    EXPECT_EQ(theirs.modes.representatives, ours.modes.representatives);
    EXPECT_LT((theirs.z_centre - ours.z_centre).norm(), 1e-4f * ours.z_scale.cwiseInverse().norm());
    EXPECT_LT((theirs.out_scale - ours.out_scale).norm(), 1e-2f * ours.out_scale.norm());
    EXPECT_TRUE(theirs.centre_map.numbers().isApprox(ours.centre_map.numbers(), 1e-2f));
    EXPECT_LT(radius_error(trained, recording), 0.5 * error_before);
    EXPECT_EQ(files_in_folder(), 4u);  // data, two trees, the log
    // Trains again from a tree written by the script.
    python(NBD_TORCH "/train.py",
           "trained.h5 data.h5 -o again.h5 --epochs 2 --device cpu --hidden 16 --linear-centre 0");
    const TreeFile again = load_tree(folder / "again.h5");
    EXPECT_EQ(again.tree.nbd->networks.hidden(), 16);
    EXPECT_EQ(again.tree.nbd->centre_map.size(), 0);
}

}  // namespace
}  // namespace nbd

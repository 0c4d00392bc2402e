#include "training/files/tree_file.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "collision/flat/flat_tree.hpp"
#include "meshing/h5/inspect.hpp"
#include "tests/support/edit_file.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/training/example_tree.hpp"

namespace nbd {
namespace {

using test::EditFile;
using test::error_of;
using test::example_tree;
class TreeFileTest : public test::FileTest {};

void expect_same(const TrainingFacts& a, const TrainingFacts& b) {
    EXPECT_EQ(a.body_hash, b.body_hash);
    EXPECT_EQ(a.recording_hash, b.recording_hash);
    EXPECT_EQ(a.config, b.config);
    EXPECT_EQ(a.split.train_trajectories, b.split.train_trajectories);
    EXPECT_EQ(a.split.calibration_trajectories, b.split.calibration_trajectories);
    EXPECT_EQ(a.split.held_out_trajectories, b.split.held_out_trajectories);
    EXPECT_EQ(a.split.frame_seed, b.split.frame_seed);
    EXPECT_EQ(a.split.random_frame_share, b.split.random_frame_share);
    EXPECT_EQ(a.split.troubled_frames, b.split.troubled_frames);
    EXPECT_EQ(a.poses, b.poses);
    EXPECT_EQ(a.node_loss, b.node_loss);
    EXPECT_EQ(a.z_error, b.z_error);
    EXPECT_EQ(a.trained_on, b.trained_on);
    EXPECT_EQ(a.calibrated_on, b.calibrated_on);
}

void expect_same(const TreeFile& a, const TreeFile& b) {
    EXPECT_EQ(test::fields_of(a.tree), test::fields_of(b.tree));
    EXPECT_EQ(a.X, b.X);
    EXPECT_EQ(a.W.toDense(), b.W.toDense());
    expect_same(a.facts, b.facts);
}

TEST_F(TreeFileTest, RoundTripsEveryFieldOfEveryModel) {
    TreeFile file = example_tree({.grid = 8, .depth = 3, .modes = 5, .representatives = 12});
    const auto fields = test::fields_of(file.tree);
    EXPECT_EQ(fields.size(), 62u) << "a field is new: does this test fill it?";
    for (const auto& [name, content] : fields)
        EXPECT_EQ(content.ends_with(" 0 x 1 "), name == "calibration/bd/limits") << name << " is empty";
    save_tree(folder / "tree.h5", file);
    expect_same(load_tree(folder / "tree.h5"), file);
    file.tree.nbd->centre_map = FixedMatrix();  // no linear part and float32, as in the paper
    file.tree.nbd->networks = test::float_networks(*file.tree.nbd);
    file.facts.split.troubled_frames = true;
    save_tree(folder / "tree.h5", file);
    expect_same(load_tree(folder / "tree.h5"), file);
    EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(TreeFileTest, DropsNbdCalibrationsWithoutACoordinateSpread) {
    TreeFile file = example_tree({.grid = 8, .depth = 2, .modes = 4, .representatives = 9});
    file.tree.nbd->z_mean.resize(0);
    file.tree.nbd->z_whitening.resize(0, 0);
    save_tree(folder / "old.h5", file);
    file.tree.calibrations.erase(BoundKind::nbd);
    EXPECT_FALSE(file.tree.calibrations.empty());
    expect_same(load_tree(folder / "old.h5"), file);
}

TEST_F(TreeFileTest, DropsCalibrationsOfNetworksThatLoadingRounds) {
    const TreeFile file = example_tree({.grid = 8, .depth = 2, .modes = 4, .representatives = 9});
    save_tree(folder / "tree.h5", file);
    EXPECT_TRUE(load_tree(folder / "tree.h5").tree.calibrations.contains(BoundKind::nbd));
    EditFile(folder / "tree.h5").set("nbd/weights", 3, 0.123f);
    const TreeFile rounded = load_tree(folder / "tree.h5");
    EXPECT_EQ(rounded.tree.calibrations.size(), 1u);
    EXPECT_TRUE(rounded.tree.calibrations.contains(BoundKind::learned_affine));
}

TEST_F(TreeFileTest, NeedsNoModels) {
    TreeFile file = example_tree({.grid = 8, .depth = 3, .modes = 5, .representatives = 12});
    file.tree.bd.reset();
    file.tree.calibrations.erase(BoundKind::bd);
    save_tree(folder / "nbd.h5", file);
    expect_same(load_tree(folder / "nbd.h5"), file);
    file.tree.nbd.reset();
    file.tree.calibrations.clear();
    save_tree(folder / "learned.h5", file);
    expect_same(load_tree(folder / "learned.h5"), file);
    file.tree.learned_affine.reset();
    file.facts = {};
    save_tree(folder / "exact.h5", file);
    expect_same(load_tree(folder / "exact.h5"), file);
}

TEST_F(TreeFileTest, KeepsSeparateModesOfBothModels) {
    TreeFile file = example_tree({.grid = 8, .depth = 2, .modes = 4, .representatives = 9});
    file.tree.bd->modes.w[3] += 1;
    save_tree(folder / "tree.h5", file);
    expect_same(load_tree(folder / "tree.h5"), file);
}

// The paper's sizes: 16200 faces, depth 7, 128 modes, 512 representatives, 32 hidden units. Random numbers
// compress like trained weights: only signs and exponents deflate.
TEST_F(TreeFileTest, IsBelowEightMegabytesAtThePapersSizes) {
    const auto path = folder / "tree.h5";
    TreeFile file = example_tree({.grid = 90, .depth = 7, .modes = 128, .representatives = 512});
    ASSERT_EQ(file.tree.spheres.nodes.size(), 255u);
    save_tree(path, file);
    const auto both = std::filesystem::file_size(path);
    file.tree.bd.reset();
    file.tree.calibrations.erase(BoundKind::bd);
    save_tree(path, file);
    const auto nbd = std::filesystem::file_size(path);
    std::cout << "bd and nbd: " << both << " bytes, nbd alone: " << nbd << " bytes\n";
    EXPECT_LT(both, 8000000u);
    EXPECT_LT(nbd, both);
}

TEST_F(TreeFileTest, RefusesToSaveATreeThatWouldNotLoad) {
    TreeFile file = example_tree({.grid = 8, .depth = 2, .modes = 4, .representatives = 9});
    file.tree.nbd->out_scale(1, 5) = std::numeric_limits<float>::quiet_NaN();
    const std::string error = error_of([&] { save_tree(folder / "tree.h5", file); });
    test::expect_clear(error, folder / "tree.h5");
    EXPECT_NE(error.find("the scaling of the outputs is not finite"), std::string::npos) << error;
    EXPECT_EQ(files_in_folder(), 0u);
}

TEST_F(TreeFileTest, HasAffineBoundsOnlyWhereTheyWereSaved) {
    TreeFile file = example_tree({.grid = 8, .depth = 2, .modes = 4, .representatives = 9});
    file.tree.affine.reset();  // as in a file of an earlier version
    save_tree(folder / "tree.h5", file);
    expect_same(load_tree(folder / "tree.h5"), file);
}

TEST_F(TreeFileTest, RefusesToSaveAffineBoundsWithOtherWeights) {
    TreeFile file = example_tree({.grid = 8, .depth = 2, .modes = 4, .representatives = 9});
    for (const int node : {0, 1}) file.W.coeffRef(5, node) = 0.5f;
    file.W.coeffRef(5, 5) = 0;
    EXPECT_EQ(error_of([&] { save_tree(folder / "tree.h5", file); }),
              (folder / "tree.h5").string() +
                  ": the affine model has other weights than the embedding; allowed: the same ones");
    EXPECT_EQ(files_in_folder(), 0u);
}

std::string read_everything(const std::filesystem::path& path) {
    load_tree(path);
    return h5::inspect(path).substr(path.string().size());
}

TEST_F(TreeFileTest, DetectsRandomDamage) {
    const auto path = folder / "tree.h5";
    const TreeFile whole = example_tree({.grid = 8, .depth = 3, .modes = 5, .representatives = 12});
    save_tree(path, whole);
    test::expect_damage_is_found(path, [&](const auto& file) {
        expect_same(load_tree(file), whole);
        return std::string();
    });
    test::expect_damage_is_found(path, read_everything, 0, 60);
}

class BrokenTreeFile : public TreeFileTest, public ::testing::WithParamInterface<test::BrokenFile> {};

TEST_P(BrokenTreeFile, IsRejectedInOneLine) {
    const auto path = folder / "tree.h5";
    save_tree(path, example_tree({.grid = 8, .depth = 3, .modes = 5, .representatives = 12}));
    test::expect_refused(path, GetParam(), [](const auto& file) { load_tree(file); });
}

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

const test::BrokenFile broken_trees[] = {
    {"is a file of format 'nbdtree recording'; allowed: 'nbdtree tree'",
     [](EditFile& f) { f.set_attribute("/", "format", "nbdtree recording"); }},
    {"is a file of 'nbdtree tree' version 3", [](EditFile& f) { f.set_attribute("/", "format_version", 3); }},
    {"is a tree of version 1; allowed: version 2; train the tree again with `nbdtree train`",
     [](EditFile& f) { f.set_attribute("/", "format_version", 1); }},
    {"has no attribute 'body_sha256'", [](EditFile& f) { f.remove_attribute("/", "body_sha256"); }},
    {"dataset 'surface/vertices' is 64 x 2; allowed: n x 3",
     [](EditFile& f) {
         f.replace("surface/vertices", {64, 2}, std::vector<float>(128));
     }},
    {"surface/vertices has a number that is not finite",
     [](EditFile& f) { f.set("surface/vertices", 7, nan); }},
    {"the embedding has 0 nodes", [](EditFile& f) { f.set_attribute("embedding", "nodes", 0); }},
    {"embedding/cols: row 3 refers to column 64; allowed: 0 to 63, ascending",
     [](EditFile& f) { f.set("embedding/cols", 3, 64); }},
    {"the weights of vertex 5 sum to 2; allowed: 1", [](EditFile& f) { f.set("embedding/values", 5, 2.f); }},
    {"face 1 refers to vertex -3", [](EditFile& f) { f.set("surface/faces", 4, -3); }},
    {"dataset 'topology/nodes' is 10; allowed: n x 6",
     [](EditFile& f) { f.replace("topology/nodes", {10}, std::vector<int>(10)); }},
    {"dataset 'topology/rest_spheres' is 15 x 4; allowed: 14 x 4",
     [](EditFile& f) {
         f.replace("topology/nodes", {14, 6}, std::vector<int>(84));
     }},
    {"sphere tree: has no nodes",
     [](EditFile& f) {
         f.replace("topology/nodes", {0, 6}, std::vector<int>());
         f.replace("topology/rest_spheres", {0, 4}, std::vector<float>());
         f.remove("bd"), f.remove("nbd"), f.remove("learned_affine"), f.remove("calibration");
     }},
    {"node 0 has its first child at 1000000", [](EditFile& f) { f.set("topology/nodes", 0, 1000000); }},
    {"the root owns faces", [](EditFile& f) { f.set("topology/nodes", 3, 127); }},
    {"lists face 128", [](EditFile& f) { f.set("topology/faces", 17, 128); }},
    {"lists vertex 64", [](EditFile& f) { f.set("topology/vertices", 2, 64); }},
    {"the rest sphere of node 2", [](EditFile& f) { f.set("topology/rest_spheres", 8, nan); }},
    {"dataset 'bd/z_to_q' is 4 x 5; allowed: 5 x 5",
     [](EditFile& f) {
         f.replace("bd/z_to_q", {4, 5}, std::vector<float>(20));
     }},
    {"an entry of dr is negative", [](EditFile& f) { f.set("bd/dr", 3, -1.f); }},
    {"an entry of Ubar is not finite", [](EditFile& f) { f.set("bd/Ubar", 3, nan); }},
    {"modes: representative vertex 64", [](EditFile& f) { f.set("nbd/modes/representatives", 1, 64); }},
    {"modes: weight 2 is 0", [](EditFile& f) { f.set("nbd/modes/weights", 2, 0.f); }},
    {"has no 'nbd/modes/representatives'; allowed: a file with this item",
     [](EditFile& f) { f.remove("bd"), f.remove("nbd/modes"); }},
    {"'bd/modes/representatives'", [](EditFile& f) { f.remove("nbd"); }},
    {"dataset 'bd/modes/U' is 36; allowed: 36 x n",
     [](EditFile& f) { f.replace("nbd/modes/U", {36}, std::vector<float>(36)); }},
    {"NBD-Tree: hidden width 100000, allowed: 1 to 128",
     [](EditFile& f) { f.set_attribute("nbd", "hidden", 100000); }},
    {"the networks have halves as numbers; allowed: bytes and floats",
     [](EditFile& f) { f.set_attribute("nbd", "numbers", "halves"); }},
    {"dataset 'nbd/weights' is 15 x 1380; allowed: 15 x",
     [](EditFile& f) { f.set_attribute("nbd", "hidden", 16); }},
    {"NBD-Tree: a weight of node 1", [](EditFile& f) { f.set("nbd/weights", 1380 + 7, nan); }},
    {"dataset 'nbd/out_scale' is 4 x 14; allowed: 4 x 15",
     [](EditFile& f) {
         f.replace("nbd/out_scale", {4, 14}, std::vector<float>(56));
     }},
    {"dataset 'nbd/centre_map' is 5 x 44; allowed: 5 x 45",
     [](EditFile& f) {
         f.replace("nbd/centre_map", {5, 44}, std::vector<float>(220));
     }},
    {"dataset 'affine/rest' is 63 x 3; allowed: 64 x 3",
     [](EditFile& f) {
         f.replace("affine/rest", {63, 3}, std::vector<float>(189));
     }},
    {"the rest position of node 2 is not finite", [](EditFile& f) { f.set("affine/rest", 7, nan); }},
    {"has no 'affine/rest'; allowed: a file with this item", [](EditFile& f) { f.remove("affine/rest"); }},
    {"vertex 5 has the weight -1; allowed: 0 or more, but for rounding errors",
     [](EditFile& f) {
         std::vector<int> rows(65), cols;
         std::vector<float> values;
         for (int v = 0; v < 64; ++v) {
             cols.push_back(v);
             values.push_back(v == 5 ? -1.f : 1.f);
             if (v == 5) cols.push_back(9), values.push_back(2);
             rows[v + 1] = cols.size();
         }
         f.replace("embedding/rows", {65}, rows);
         f.replace("embedding/cols", {65}, cols);
         f.replace("embedding/values", {65}, values);
     }},
    {"the weights of vertex 5 sum to 1.00005; allowed: 1, within 1e-05",
     [](EditFile& f) { f.set("embedding/values", 5, 1.00005f); }},
    {"calibration of bd bounds, but the tree has no model for them", [](EditFile& f) { f.remove("bd"); }},
    {"dataset 'calibration/nbd/margins' is 14; allowed: 15",
     [](EditFile& f) { f.replace("calibration/nbd/margins", {14}, std::vector<float>(14)); }},
    {"calibration of bd bounds: margin of node 2 is nan",
     [](EditFile& f) { f.set("calibration/bd/margins", 2, nan); }},
    {"calibration of bd bounds: miss rate is 1, allowed",
     [](EditFile& f) { f.set_attribute("calibration/bd", "miss_rate", 1.0); }},
    {"calibration of nbd bounds: made from 0 poses of 20 trajectories",
     [](EditFile& f) { f.set_attribute("calibration/nbd", "poses", 0); }},
    {"has no 'facts'", [](EditFile& f) { f.remove("facts"); }},
    {"-1 training poses", [](EditFile& f) { f.set_attribute("facts", "poses", -1); }},
    {"random_frame_share is 1.5; allowed: 0 to 1",
     [](EditFile& f) { f.set_attribute("facts", "random_frame_share", 1.5); }},
    {"facts/node_loss has 3 numbers; allowed: none or 15",
     [](EditFile& f) { f.replace("facts/node_loss", {3}, std::vector<float>(3)); }},
};

INSTANTIATE_TEST_SUITE_P(All, BrokenTreeFile, ::testing::ValuesIn(broken_trees));

}  // namespace
}  // namespace nbd

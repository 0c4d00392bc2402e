#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "collision/bounds/certified/build_certified_model.hpp"
#include "collision/bounds/certified/solid_meter.hpp"
#include "collision/tree/posed_tree.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/edit_file.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/solid_bodies.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {
namespace {

class CertifiedFileTest : public test::FileTest {
 protected:
    static TreeFile box_tree() {
        const test::SolidBody box = test::solid_box();
        TreeFile file;
        file.X = box.X;
        file.W = box.W;
        file.solid = box.solid;
        file.tree = make_exact_tree(box.X, box.F, {.depth = 4, .min_leaf_faces = 2});
        file.tree.certified =
            build_certified_model(file.tree.spheres, box.F, box.solid, box.W, {.anchors = 9});
        file.facts.body_hash = std::string(64, 'b');
        return file;
    }

    /// Radii of all nodes in one pose.
    static std::vector<float> radii(const TreeFile& file) {
        const auto tree = std::make_shared<const CollisionTree>(file.tree);
        SolidMeter meter(file.solid, std::make_shared<const TetRegions>(tree->certified->regions));
        const Vertices nodes = (file.solid.X + test::wild_field(file.solid.X, 0.05)).cast<float>();
        const Vertices x = file.W * nodes;
        PosedTree posed(tree, BoundKind::certified);
        posed.begin_pose(x, meter.measure(nodes));
        std::vector<float> result;
        for (int i = 0; i < static_cast<int>(tree->spheres.nodes.size()); ++i)
            result.push_back(posed.sphere(i).r);
        return result;
    }
};

TEST_F(CertifiedFileTest, RoundTripsBitForBit) {
    const TreeFile file = box_tree();
    save_tree(folder / "tree.h5", file);
    const TreeFile again = load_tree(folder / "tree.h5");
    EXPECT_EQ(again.solid.X, file.solid.X);
    EXPECT_EQ(again.solid.T, file.solid.T);
    EXPECT_EQ(radii(again), radii(file));
    EXPECT_EQ(again.tree.certified->rounding, file.tree.certified->rounding);
}

TEST_F(CertifiedFileTest, RejectsASolidOfAnotherBody) {
    TreeFile file = box_tree();
    file.solid.T.conservativeResize(file.solid.T.rows() - 1, 4);
    const std::string error = test::error_of([&] { save_tree(folder / "tree.h5", file); });
    EXPECT_NE(error.find("certified bounds are for 486 tetrahedra"), std::string::npos) << error;
    EXPECT_FALSE(std::filesystem::exists(folder / "tree.h5"));
}

TEST_F(CertifiedFileTest, ReportsInvalidDatasetsByName) {
    const TreeFile file = box_tree();
    const auto refused = [&](const std::string& expected, const auto& damage) {
        save_tree(folder / "tree.h5", file);
        {
            test::EditFile edit(folder / "tree.h5");
            damage(edit);
        }
        const std::string error = test::error_of([&] { load_tree(folder / "tree.h5"); });
        EXPECT_NE(error.find(expected), std::string::npos) << error;
    };
    refused("cell 0 has its anchor at vertex 99999",
            [](test::EditFile& f) { f.set("certified/cells", 0, 99999); });
    refused("cell 2 has a number that is not finite or out of range",
            [](test::EditFile& f) { f.set("certified/cell_shapes", 28, -1.f); });
    refused("regions of tetrahedra", [](test::EditFile& f) {
        f.replace("certified/tet_region", {3}, std::vector<int>{0, 0, 0});
    });
    refused("solid: node 5 is not finite", [](test::EditFile& f) { f.set("solid/nodes", 16, std::nan("")); });
    refused("solid", [](test::EditFile& f) { f.remove("solid"); });
    refused("certified/pairs", [](test::EditFile& f) { f.remove("certified/pairs"); });
}

TEST_F(CertifiedFileTest, PosedTreesRejectAMissingModel) {
    TreeFile file = box_tree();
    file.tree.certified.reset();
    const std::string error = test::error_of(
        [&] { PosedTree(std::make_shared<const CollisionTree>(file.tree), BoundKind::certified); });
    EXPECT_NE(error.find("no model for \"certified\" bounds"), std::string::npos) << error;
}

}  // namespace
}  // namespace nbd

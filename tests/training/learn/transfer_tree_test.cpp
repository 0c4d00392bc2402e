#include "training/learn/transfer_tree.hpp"

#include <gtest/gtest.h>

#include "collision/tree/posed_tree.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/training/bar.hpp"
#include "training/learn/train_tree.hpp"

namespace nbd {
namespace {

using test::Bar;

class TransferTree : public test::FileTest {
 protected:
    TreeFile trained() const {
        coarse.record(folder / "data.h5", 12, 25, 2);
        TrainConfig config;
        config.bounds = {BoundKind::nbd};
        config.tree.depth = 4;
        config.mlp.max_epochs = 10;
        TreeFile file = train_tree(coarse.body, RecordingReader(folder / "data.h5"), config);
        const std::size_t nodes = file.tree.spheres.nodes.size();
        file.tree.calibrations[BoundKind::nbd] = {.miss_rate = 0.01,
                                                  .confidence = 0.9,
                                                  .trajectories = 2,
                                                  .poses = 50,
                                                  .margins = std::vector<float>(nodes, 0.01f)};
        return file;
    }
    Bar coarse{12, 4}, fine{12, 8};
};

TEST_F(TransferTree, BoundsTheSameNodesOfAFinerSurface) {
    const TreeFile before = trained();
    const TreeFile after = transfer_tree(before, fine.body);
    EXPECT_NO_THROW(check_collision_tree(after.tree));
    EXPECT_EQ(after.tree.spheres.nodes.size(), before.tree.spheres.nodes.size());
    EXPECT_EQ(after.tree.faces, fine.body.F);
    EXPECT_EQ(after.facts.body_hash, fine.body.hash);
    EXPECT_EQ(after.tree.calibrations.at(BoundKind::nbd).margins[3], 0.01f);
    for (std::size_t i = 0; i < after.tree.spheres.nodes.size(); ++i) {
        const SphereTree::Node &a = before.tree.spheres.nodes[i], &b = after.tree.spheres.nodes[i];
        EXPECT_EQ(b.first_child, a.first_child);
        EXPECT_EQ(b.face_end - b.face_begin, 4 * (a.face_end - a.face_begin));
        const Sphere &s = before.tree.spheres.rest[i], &t = after.tree.spheres.rest[i];
        EXPECT_LT((s.c - t.c).norm(), 0.15f * s.r) << i;
    }
}

TEST_F(TransferTree, KeepsNbdSpheres) {
    const Bar coarse(12, 4), fine(12, 8);
    coarse.record(folder / "data.h5", 12, 25, 2);
    TrainConfig config;
    config.bounds = {BoundKind::nbd};
    config.tree.depth = 3;
    const TreeFile before = train_tree(coarse.body, RecordingReader(folder / "data.h5"), config);
    const TreeFile after = transfer_tree(before, fine.body);
    EXPECT_NO_THROW(check_collision_tree(after.tree));
    PosedTree a(std::make_shared<const CollisionTree>(before.tree), BoundKind::nbd, 0.f),
        b(std::make_shared<const CollisionTree>(after.tree), BoundKind::nbd, 0.f);
    float moved = 0;
    for (int frame = 0; frame < 5; ++frame) {
        Vertices x, y;
        apply_embedding(coarse.body.W, coarse.frame(99, frame, frame), x);
        apply_embedding(fine.body.W, fine.frame(99, frame, frame), y);
        a.begin_pose(x);
        b.begin_pose(y);
        for (int i = 0; i < std::ssize(before.tree.spheres.nodes); ++i) {
            const Sphere &s = a.sphere(i), &t = b.sphere(i), &rest = before.tree.spheres.rest[i];
            EXPECT_LT((s.c - t.c).norm(), 1e-4f * rest.r) << i;
            EXPECT_NEAR(s.r, t.r, 1e-4f * rest.r) << i;
            moved = std::max(moved, (s.c - rest.c).norm() / rest.r);
        }
    }
    EXPECT_GT(moved, 0.1f);
}

TEST_F(TransferTree, RejectsOtherSurfacesAndTreesWithoutTransferableBounds) {
    TreeFile before = trained();
    SurfaceBody other = fine.body;
    other.X *= 1.5f;
    EXPECT_NE(test::refusal([&] { transfer_tree(before, other); }), "");
    const SurfaceBody coarser = Bar(12, 1).body;
    EXPECT_NE(
        test::refusal([&] { transfer_tree(before, coarser); }).find("from the surface's nearest vertex"),
        std::string::npos);
    SurfaceBody part = fine.body;
    part.F = fine.body.F.topRows(40).eval();
    EXPECT_NE(
        test::refusal([&] { transfer_tree(before, part); }).find("gets no face: the surface is too coarse"),
        std::string::npos);
    before.tree.nbd.reset();
    before.tree.calibrations.clear();
    EXPECT_EQ(test::refusal([&] { transfer_tree(before, fine.body); }),
              "the tree has no nbd bounds to transfer");
}

}  // namespace
}  // namespace nbd

#include "collision/wide_tree/posed_wide_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "tests/collision/wide_tree/hung_surface.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::HungSurface;

std::shared_ptr<const AffineModel> model_of(const HungSurface& hung) { return test::hung_tree(hung)->affine; }

std::vector<HungSurface> hung_surfaces() {
    return {test::hung_on_lattice(shapes::torus(120, 60), 3), test::hung_on_lattice(shapes::torus(60, 50), 9),
            test::hung_on_itself(shapes::sphere(25, 30)),     test::hung_on_lattice(shapes::sphere(3, 4), 1),
            test::hung_on_tets(shapes::bar(50, 40), 6),       test::hung_on_itself(shapes::torus(100, 60))};
}

/// How far a point sticks out of a box; 0 inside.
float outside(const Box& box, const Eigen::RowVector3f& p) {
    const Eigen::Array3f x = p.transpose().array();
    return std::max((box.lo.head<3>() - x).maxCoeff(), (x - box.hi.head<3>()).maxCoeff());
}

/// How far a point sticks out of the slab of an oriented box; 0 where that has none.
double outside_slab(const OrientedBoxes& boxes, int i, const Eigen::RowVector3f& p) {
    double along = 0;
    for (int a = 0; a < 3; ++a) along += double{boxes.normal[a][i]} * double{p[a]};
    if (!std::isfinite(along)) return 0;
    return std::max(boxes.lo[i] - along, along - boxes.hi[i]);
}

/// Expects every box of a posed tree to contain the vertices below it, and leaves to hold the positions x.
void expect_bounds(PosedWideTree& boxes, const Vertices& x) {
    const WideTree& tree = boxes.tree();
    for (int leaf = 0; leaf < tree.leaves(); ++leaf) {
        if (tree.faces_in[leaf] == 0) continue;
        const int block = leaf / tree_width, cluster = tree.cluster_of[block];
        const Box of_cluster = boxes.cluster_boxes()[cluster / tree_width].box(cluster % tree_width);
        const Box of_block = boxes.blocks(cluster).boxes.box(block - boxes.first_block(cluster));
        const PosedWideTree::Children& leaves = boxes.leaves(block);
        const Box own = leaves.boxes.box(leaf % tree_width);
        const PosedWideTree::Leaf& opened = boxes.leaf(leaf);
        const auto vertices = tree.leaf_vertices(leaf);
        for (std::size_t i = 0; i < vertices.size(); ++i) {
            const Eigen::RowVector3f p = x.row(vertices[i]);
            ASSERT_LE(outside(boxes.whole(), p), 0) << "body";
            ASSERT_LE(outside(of_cluster, p), 0) << "cluster " << cluster;
            ASSERT_LE(outside(boxes.cluster(cluster), p), 0) << "blocks of cluster " << cluster;
            ASSERT_LE(outside(of_block, p), 0) << "block " << block;
            ASSERT_LE(outside(own, p), 0) << "leaf " << leaf;
            ASSERT_LE(outside(leaves.whole, p), 0) << "leaves of block " << block;
            ASSERT_LE(leaves.are_oriented ? outside_slab(leaves.oriented, leaf % tree_width, p) : 0, 0)
                << "slab of leaf " << leaf;
            ASSERT_EQ(Eigen::RowVector3f(opened.x[i].head<3>().matrix().transpose()), p)
                << "vertex " << vertices[i];
        }
    }
}

/// Node numbers as places of first coordinates.
std::vector<std::int32_t> places(std::vector<std::int32_t> nodes) {
    for (std::int32_t& node : nodes) node *= 3;
    return nodes;
}

TEST(NodeLists, AreBoundedWhateverTheirLength) {
    constexpr int count = 10;
    const std::vector<std::vector<std::int32_t>> lists = {places({9}),
                                                          places({0}),
                                                          places({1, 2, 3, 4, 5}),
                                                          places({0, 3, 6, 8, 9}),
                                                          places({2, 4, 6, 8}),
                                                          places({0, 1, 2, 3, 4, 5, 6, 7, 8, 9})};
    const std::vector<std::span<const std::int32_t>> spans(lists.begin(), lists.end());
    const NodeLists node_lists(spans, count);
    std::mt19937 random(1);
    std::vector<float> x(3 * count);  // no number behind it: a sanitizer notices if one is read
    for (float& number : x) number = shapes::uniform(random);
    std::vector<Box> boxes(lists.size());
    EXPECT_TRUE(node_lists.boxes(x.data(), boxes));
    for (std::size_t l = 0; l < lists.size(); ++l) {
        Box expected = empty_box();
        for (const std::int32_t place : lists[l]) {
            const float* p = x.data() + place;
            const Eigen::Array4f point(p[0], p[1], p[2], 0);
            expected = joined(expected, {point, point});
        }
        EXPECT_TRUE((boxes[l].lo == expected.lo).all() && (boxes[l].hi == expected.hi).all()) << l;
    }
    for (float& number : x) {
        const float before = number;
        for (const float wrong :
             {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
            number = wrong;
            EXPECT_FALSE(node_lists.boxes(x.data(), boxes)) << &number - x.data();
        }
        number = before;
    }
}

TEST(AffineBoxes, ContainTheSurfaceInWildPoses) {
    std::mt19937 random(1);
    for (const HungSurface& hung : hung_surfaces()) {
        PosedWideTree boxes(model_of(hung));
        for (int kind = 0; kind < 4 * test::wild_poses; ++kind) {
            const Vertices nodes = test::wild_pose(hung.rest, kind, random), x = embedded(hung.W, nodes);
            boxes.begin_pose(nodes);
            expect_bounds(boxes, x);
            if (HasFatalFailure()) FAIL() << "pose " << kind;
        }
    }
}

TEST(AffineBoxes, ContainSurfacesWhoseClustersListTheNodesOfTheirBlocks) {
    std::mt19937 random(1);
    const shapes::Surface torus = shapes::torus(330, 210);  // clusters of up to sixteen blocks
    for (const HungSurface& hung : {test::hung_on_itself(torus), test::hung_on_tets(torus, 60)}) {
        const auto model = model_of(hung);
        int listed = 0;
        for (int c = 0; c < model->tree().clusters(); ++c)
            listed += model->clusters().child_bounds(c) == AffineParts::ChildBounds::nodes;
        EXPECT_GT(listed, model->tree().clusters() / 2);
        PosedWideTree boxes(model);
        for (int kind = 0; kind < test::wild_poses; ++kind) {
            const Vertices start = test::wild_pose(hung.rest, kind, random), x = embedded(hung.W, start),
                           end = test::wild_pose(hung.rest, kind + 1, random), y = embedded(hung.W, end);
            boxes.begin_pose(start);
            expect_bounds(boxes, x);
            boxes.begin_step(start, end);
            for (int block = 0; block < model->tree().blocks(); ++block) {
                const int cluster = model->tree().cluster_of[block];
                const Box box = boxes.blocks(cluster).boxes.box(block - boxes.first_block(cluster));
                for (const int v : model->tree().block_vertices(block)) {
                    ASSERT_LE(outside(box, x.row(v)), 0) << "block " << block << ", start";
                    ASSERT_LE(outside(box, y.row(v)), 0) << "block " << block << ", end";
                }
            }
            if (HasFatalFailure()) FAIL() << "pose " << kind;
        }
    }
}

TEST(AffineBoxes, AreOrientedWhereMapsBoundThem) {
    int oriented = 0, not_oriented = 0;
    for (const HungSurface& hung : hung_surfaces()) {
        const auto model = model_of(hung);
        PosedWideTree boxes(model);
        boxes.begin_pose(hung.rest);
        for (int c = 0; c < model->tree().clusters(); ++c) boxes.blocks(c);
        for (int b = 0; b < model->tree().blocks(); ++b) {
            const bool mapped = model->blocks().child_bounds(b) == AffineParts::ChildBounds::map;
            EXPECT_EQ(boxes.leaves(b).are_oriented, mapped);
            (mapped ? oriented : not_oriented)++;
        }
    }
    EXPECT_GT(oriented, 0);
    EXPECT_GT(not_oriented, 0);
}

TEST(AffineBoxes, HoldPositionsThatRoundOutOfThePlaneOfTheirNodes) {
    Eigen::Index rounded = 0;
    for (const HungSurface& hung : hung_surfaces()) {
        PosedWideTree boxes(model_of(hung));
        for (const float height : {0.1f, 1.7f, -1234.5f}) {
            Vertices nodes = hung.rest;
            nodes.col(2).setConstant(height);
            const Vertices x = embedded(hung.W, nodes);
            rounded += (x.col(2).array() != height).count();
            boxes.begin_pose(nodes);
            expect_bounds(boxes, x);
            if (HasFatalFailure()) FAIL() << "height " << height;
        }
    }
    EXPECT_GT(rounded, 100);
}

TEST(AffineBoxes, FromNodesAreTightWhereTheMotionIsAffine) {
    const HungSurface hung = test::hung_on_lattice(shapes::torus(200, 100), 4);
    PosedWideTree boxes(model_of(hung));
    const WideTree& tree = boxes.tree();
    Eigen::Matrix3f A;
    A << 1, 0.2f, 0, -0.1f, 0.9f, 0.3f, 0, 0, 1.1f;
    const Vertices nodes = hung.rest * A.transpose(), x = embedded(hung.W, nodes);
    boxes.begin_pose(nodes);
    WideBoxes exact;
    fit_wide_boxes(tree, x, exact);
    double sizes = 0, exact_sizes = 0;
    for (int block = 0; block < tree.blocks(); ++block) {
        boxes.blocks(tree.cluster_of[block]);
        for (int k = 0; k < tree.leaves_in[block]; ++k) {
            const Box own = boxes.leaves(block).boxes.box(k), least = exact.leaves[tree_width * block + k];
            sizes += (own.hi - own.lo).sum();
            exact_sizes += (least.hi - least.lo).sum();
        }
    }
    EXPECT_LT(sizes, 1.3 * exact_sizes);
}

TEST(AffineBoxes, TakeNodesWithRoomBetweenRows) {
    const HungSurface hung = test::hung_on_lattice(shapes::torus(60, 50), 3);
    PosedWideTree boxes(model_of(hung));
    Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor> wide(hung.rest.rows(), 4);
    wide.leftCols<3>() = hung.rest;
    wide.col(3).setConstant(1e9f);
    boxes.begin_pose(VertexView(wide.data(), wide.rows(), 4));
    expect_bounds(boxes, hung.surface.X);
}

TEST(AffineModel, RefusesWeightsThatCannotBound) {
    HungSurface hung = test::hung_on_lattice(shapes::sphere(3, 4), 1);
    const auto error = [&](const SurfaceEmbedding& W, const Vertices& rest) {
        CollisionTree tree = make_exact_tree(hung.surface.X, hung.surface.F);
        return test::error_of([&] { hang_on_nodes(tree, W, rest); });
    };
    EXPECT_EQ(error(hung.W, hung.rest), "");
    SurfaceEmbedding W = hung.W;
    W.coeffRef(2, 3) -= 2;
    EXPECT_NE(error(W, hung.rest).find("vertex 2 has the weight -"), std::string::npos);
    W = hung.W;
    W.coeffRef(5, 1) += 0.001f;
    EXPECT_NE(error(W, hung.rest).find("the weights of vertex 5 sum to 1.001; allowed: 1, within 1e-05"),
              std::string::npos);
    W = hung.W;
    W.coeffRef(4, 0) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NE(error(W, hung.rest).find("vertex 4 has the weight"), std::string::npos);
    EXPECT_NE(error(SurfaceEmbedding(3, 8), hung.rest).find("the embedding has 3 rows"), std::string::npos);
    EXPECT_NE(error(hung.W, hung.rest.topRows(5)).find("refers to 8 nodes"), std::string::npos);
    Vertices rest = hung.rest;
    rest(6, 2) = std::numeric_limits<float>::infinity();
    EXPECT_EQ(error(hung.W, rest), "the rest position of node 6 is not finite");
}

TEST(AffineModel, IsMadeAgainFromItsWeightsAndRestNodes) {
    std::mt19937 random(3);
    for (const HungSurface& hung :
         {test::hung_on_lattice(shapes::torus(60, 50), 3), test::hung_on_tets(shapes::sphere(9, 12), 2),
          test::hung_on_itself(shapes::sphere(9, 12))}) {
        const auto first = model_of(hung);
        EXPECT_TRUE(first->hangs_by(hung.W));
        EXPECT_EQ(first->rest(), hung.rest);
        EXPECT_EQ(first->weights().toDense(), hung.W.toDense());
        const auto again = std::make_shared<const AffineModel>(hung.surface.F, first->tree().vertex_count,
                                                               first->weights(), first->rest());
        EXPECT_EQ(again->rounding(), first->rounding());
        EXPECT_EQ(again->bytes(), first->bytes());
        PosedWideTree a(first), b(again);
        const Vertices nodes = test::wild_pose(hung.rest, 3, random);
        a.begin_pose(nodes);
        b.begin_pose(nodes);
        for (int block = 0; block < first->tree().blocks(); ++block) {
            const int cluster = first->tree().cluster_of[block];
            EXPECT_EQ(std::memcmp(&a.blocks(cluster).boxes, &b.blocks(cluster).boxes, sizeof(BoxPack)), 0);
            EXPECT_EQ(std::memcmp(&a.leaves(block).boxes, &b.leaves(block).boxes, sizeof(BoxPack)), 0);
        }
        SurfaceEmbedding other = hung.W;
        other.coeffRef(4, 0) += 0.25f;
        EXPECT_FALSE(first->hangs_by(other));
        EXPECT_FALSE(first->hangs_by(hung.W.topRows(4)));
    }
}

TEST(AffineModel, IgnoresZerosAndVerticesWithoutAFace) {
    HungSurface hung = test::hung_on_tets(shapes::sphere(5, 6), 2);
    const auto rows = hung.W.rows();
    const float rounding = model_of(hung)->rounding();
    hung.W.conservativeResize(rows + 1, hung.W.cols());
    hung.W.coeffRef(rows, 3) = -7;
    for (int node = 0; node < hung.W.cols(); ++node) hung.W.coeffRef(2, node) += 0.f;
    hung.surface.X.conservativeResize(rows + 1, 3);
    hung.surface.X.row(rows).setZero();
    const auto model = model_of(hung);
    EXPECT_EQ(model->rounding(), rounding);
    EXPECT_TRUE(model->hangs_by(hung.W));
    const SurfaceEmbedding W = model->weights();
    ASSERT_EQ(W.rows(), rows + 1);
    EXPECT_EQ(W.row(rows).nonZeros(), 0);
    EXPECT_EQ(W.toDense().topRows(rows), hung.W.toDense().topRows(rows));
}

TEST(AffineModel, TakesAtMostFiftyBytesAFace) {
    // The nodes of a tetrahedron carry a vertex of an embedded surface: four weights.
    for (const HungSurface& hung :
         {test::hung_on_tets(shapes::torus(400, 200), 12), test::hung_on_itself(shapes::torus(400, 200))}) {
        const auto faces = static_cast<double>(hung.surface.F.rows());
        EXPECT_LE(static_cast<double>(model_of(hung)->bytes()), 50 * faces);
    }
}

}  // namespace
}  // namespace nbd

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "collision/base/message.hpp"
#include "collision/kernels/kernels.hpp"
#include "collision/query/closest_query.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/wide_tree/posed_wide_tree.hpp"
#include "tests/collision/models.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::error_of;

/// A torus of several clusters.
struct Torus {
    shapes::Surface s = shapes::torus(110, 60, 2, 1);
    CollisionTree tree = make_exact_tree(s.X, s.F);
    std::shared_ptr<const LearnedAffineModel> model = shapes::sampled_affine_model(tree, s.X);

    const WideTree& wide() const { return tree.boxes->tree(); }
    std::shared_ptr<const CollisionTree> shared() const {
        CollisionTree with_model = tree;
        with_model.learned_affine = model;
        return std::make_shared<const CollisionTree>(std::move(with_model));
    }
    NodeMargins margins(float margin, std::vector<float> limits = {}) const {
        return {std::vector<float>(model->bounds(), margin), std::move(limits)};
    }
    PosedWideTree boxes(NodeMargins margins) const {
        return PosedWideTree(tree.boxes, LearnedAffineBoxes(model, std::move(margins)));
    }
    /// Bent about y, turned and moved.
    Vertices bent(float by, unsigned seed) const {
        Vertices x = s.X;
        for (Eigen::Index i = 0; i < x.rows(); ++i) x(i, 2) += by * s.X(i, 0) * s.X(i, 0);
        std::srand(seed);
        const Eigen::Matrix3f turn = Eigen::Quaternionf(Eigen::Vector4f::Random()).normalized().matrix();
        x = (x * turn.transpose()).eval();
        x.rowwise() += Eigen::RowVector3f(0.3f, -0.2f, 0.1f) * static_cast<float>(seed);
        return x;
    }
};

/// How far nodes protrude from their boxes, at most, and by how much the diagonal of a box exceeds that of
/// the exact one, at most.
struct Fit {
    float protrusion = -1e30f, excess = 0;

    void add(const Box& box, const Box& exact) {
        protrusion = std::max(protrusion, outside(box, exact));
        const auto diagonal = [](const Box& b) { return (b.hi - b.lo).matrix().norm(); };
        excess = std::max(excess, diagonal(box) - diagonal(exact));
    }
};

Fit fit_of_children(PosedWideTree& boxes, VerticesRef x) {
    const WideTree& tree = boxes.tree();
    WideBoxes exact;
    fit_wide_boxes(tree, x, exact);
    Fit fit;
    for (int c = 0; c < tree.clusters(); ++c)
        for (int k = 0; k < tree.blocks_in(c); ++k)
            fit.add(boxes.blocks(c).boxes.box(k), exact.blocks[tree.first_block[c] + k]);
    for (int b = 0; b < tree.blocks(); ++b)
        for (int k = 0; k < tree.leaves_in[b]; ++k)
            fit.add(boxes.leaves(b).boxes.box(k), exact.leaves[tree_width * b + k]);
    return fit;
}

TEST(LearnedAffine, HoldsItsVerticesInAffinePosesWithoutAMargin) {
    const Torus torus;
    ASSERT_GT(torus.wide().clusters(), 2);
    Eigen::Matrix3f A;
    A << 1.2f, 0.3f, 0, -0.2f, 0.9f, 0.1f, 0.4f, 0, 1.1f;
    Vertices x = torus.s.X * A.transpose();
    x.rowwise() += Eigen::RowVector3f(5, -3, 2);
    PosedWideTree boxes = torus.boxes(torus.margins(0));
    boxes.begin_pose(x);
    const Fit fit = fit_of_children(boxes, x);
    EXPECT_LE(fit.protrusion, 0);
    EXPECT_GT(fit.excess, 0);  // boxes that move with the map lie askew
    // Such a box exceeds the exact one by what its own directions cost, and by nothing else.
    WideBoxes exact;
    fit_wide_boxes(torus.wide(), x, exact);
    double sum = 0, largest = 0;
    int count = 0;
    for (int b = 0; b < torus.wide().blocks(); ++b)
        for (int k = 0; k < torus.wide().leaves_in[b]; ++k) {
            const auto diagonal = [](const Box& box) { return double{(box.hi - box.lo).matrix().norm()}; };
            const double ratio =
                diagonal(boxes.leaves(b).boxes.box(k)) / diagonal(exact.leaves[tree_width * b + k]);
            sum += ratio;
            largest = std::max(largest, ratio);
            ++count;
        }
    EXPECT_GT(count, 500);
    EXPECT_LT(sum / count, 1.27);
    EXPECT_LT(largest, 1.72);
}

TEST(LearnedAffine, GrowsByMarginsInResiduals) {
    const Torus torus;
    const Vertices x = torus.bent(0.2f, 1);
    std::array<float, LearnedAffineModel::scratch> scratch;
    BoxPack plain;
    const float residual = torus.model->map_children(0, x.data(), scratch.data(), plain);
    EXPECT_GT(residual, 1e-4f);
    for (const float margin : {0.f, 2.f}) {
        PosedWideTree boxes = torus.boxes(torus.margins(margin));
        boxes.begin_pose(x);
        const float by = (0.5f + margin) * residual;  // 0.5 is the model's growth
        EXPECT_NEAR(boxes.blocks(0).boxes.lo[1][0], plain.lo[1][0] - by, 1e-6f);
        EXPECT_NEAR(boxes.blocks(0).boxes.hi[2][1], plain.hi[2][1] + by, 1e-6f);
    }
}

TEST(LearnedAffine, TakesExactBoxesOutOfRange) {
    const Torus torus;
    const Vertices x = torus.bent(0.2f, 1);
    const std::size_t bounds = torus.model->bounds();
    PosedWideTree boxes = torus.boxes(torus.margins(0, std::vector<float>(bounds, 0.f)));
    PosedWideTree exact(torus.tree.boxes);
    boxes.begin_pose(x);
    exact.begin_pose(x);
    EXPECT_EQ(boxes.out_of_range(), torus.model->clusters());
    for (int c = 0; c < torus.wide().clusters(); ++c) {
        EXPECT_EQ(outside(boxes.cluster(c), exact.cluster(c)), 0);
        EXPECT_EQ(outside(exact.cluster(c), boxes.cluster(c)), 0);
    }
    EXPECT_EQ(fit_of_children(boxes, x).excess, 0);
    EXPECT_EQ(boxes.out_of_range(), torus.model->bounds());

    PosedWideTree in_range = torus.boxes(torus.margins(0, std::vector<float>(bounds, 1e6f)));
    in_range.begin_pose(x);
    EXPECT_GT(fit_of_children(in_range, x).excess, 0);
    EXPECT_EQ(in_range.out_of_range(), 0);
}

TEST(LearnedAffine, AreOutOfRangeWhereNotFiniteAndNotReadInAStep) {
    const Torus torus;
    const std::size_t bounds = torus.model->bounds();
    PosedWideTree boxes = torus.boxes(torus.margins(0, std::vector<float>(bounds, 1e6f)));
    const Vertices x = torus.bent(0.2f, 1), y = torus.bent(0.3f, 1),
                   broken = Vertices::Constant(x.rows(), 3, std::numeric_limits<float>::quiet_NaN());
    boxes.begin_pose(broken);
    EXPECT_TRUE(boxes.met_non_finite());
    EXPECT_EQ(boxes.out_of_range(), torus.model->clusters());
    boxes.begin_step(x, y);
    EXPECT_FALSE(boxes.met_non_finite());
    EXPECT_EQ(boxes.out_of_range(), 0);
}

TEST(LearnedAffine, FindsThePairsOfExactBoxesWithAnAmpleMargin) {
    const Torus torus;
    const auto tree = torus.shared();
    PosedTree a(tree, BoundKind::learned_affine, 8.f), b(tree, BoundKind::learned_affine, 8.f),
        exact_a(tree, BoundKind::boxes), exact_b(tree, BoundKind::boxes);
    PairQuery query;
    ClosestQuery closest;
    std::size_t found = 0;
    for (unsigned seed = 1; seed < 6; ++seed) {
        const Vertices xa = torus.bent(0.1f, seed), xb = torus.bent(-0.15f, seed + 3);
        Vertices moved = xb;
        moved.rowwise() += (xa.colwise().mean() - xb.colwise().mean()) + Eigen::RowVector3f(0.5f, 0.3f, 0);
        for (PosedTree* body : {&a, &exact_a}) body->begin_pose(xa);
        for (PosedTree* body : {&b, &exact_b}) body->begin_pose(moved);
        const auto list = [](std::span<const FacePair> pairs) {
            return std::vector<FacePair>(pairs.begin(), pairs.end());
        };
        const std::vector<FacePair> expected = list(query.intersecting(exact_a, exact_b));
        EXPECT_EQ(list(query.intersecting(a, b)), expected);
        EXPECT_GT(query.counters().nodes_bounded, 0);
        EXPECT_EQ(query.counters().nodes_out_of_range, 0);
        EXPECT_EQ(list(query.intersecting(a, exact_b)), expected);
        EXPECT_EQ(list(query.within(a, b, 0.01f)), list(query.within(exact_a, exact_b, 0.01f)));
        found += expected.size();
    }
    EXPECT_GT(found, 500u);
}

TEST(LearnedAffine, GiveTheSameAnswersInAllForms) {
    const Torus torus;
    const Vertices x = torus.bent(0.2f, 2);
    const Kernels& before = kernels();
    std::vector<BoxPack> first;
    for (const InstructionSet set : instruction_sets) {
        const Kernels* form = kernels_for(set);
        if (!form) continue;
        use_kernels(*form);
        PosedWideTree boxes = torus.boxes(torus.margins(1));
        boxes.begin_pose(x);
        std::vector<BoxPack> all;
        for (int c = 0; c < torus.wide().clusters(); ++c) all.push_back(boxes.blocks(c).boxes);
        if (first.empty()) first = all;
        for (std::size_t i = 0; i < all.size(); ++i)
            for (int k = 0; k < torus.wide().blocks_in(i); ++k)
                for (int axis = 0; axis < 3; ++axis) {
                    EXPECT_EQ(all[i].lo[axis][k], first[i].lo[axis][k]) << name(set);
                    EXPECT_EQ(all[i].hi[axis][k], first[i].hi[axis][k]) << name(set);
                }
    }
    use_kernels(before);
}

TEST(LearnedAffine, RefusesAFitOfAnotherTree) {
    const Torus torus;
    const auto error = [&](const auto& change) {
        LearnedAffineFit fit = torus.model->fit();
        change(fit);
        return error_of([&] { LearnedAffineModel(torus.wide(), fit); });
    };
    EXPECT_EQ(error([](LearnedAffineFit&) {}), "");
    EXPECT_EQ(error([](LearnedAffineFit& fit) { fit.samples[7] = 6600; }),
              "learned affine bounds: sample vertex 6600, but the surface has 6600 vertices");
    EXPECT_EQ(error([](LearnedAffineFit& fit) { std::swap(fit.samples.front(), fit.samples.back()); }),
              message("learned affine bounds: sample vertex ", torus.model->fit().samples.back(),
                      " is not one of part 0"));
    EXPECT_EQ(
        error([](LearnedAffineFit& fit) { std::swap(fit.box_samples.front(), fit.box_samples.back()); }),
        message("learned affine bounds: sample vertex ", torus.model->fit().box_samples.back(),
                " is not one of part 0"));
    EXPECT_EQ(error([](LearnedAffineFit& fit) { fit.residual[1] = 0; }),
              "learned affine bounds: a residual is 0, allowed: above 0");
    EXPECT_EQ(error([](LearnedAffineFit& fit) { fit.growth[3] = -1; }),
              "learned affine bounds: a growth is -1, allowed: finite, 0 or more");
    EXPECT_NE(
        error([](LearnedAffineFit& fit) { fit.box_samples.pop_back(); }).find(" samples of boxes instead"),
        std::string::npos);
    EXPECT_NE(error([](LearnedAffineFit& fit) { fit.samples.pop_back(); }).find(" samples instead of "),
              std::string::npos);
    EXPECT_NE(
        error([](LearnedAffineFit& fit) { fit.clusters.pop_back(); }).find(" boxes of clusters instead"),
        std::string::npos);

    CollisionTree other = make_exact_tree(torus.s.X, torus.s.F.topRows(4000));
    other.learned_affine = torus.model;
    EXPECT_EQ(error_of([&] { check_collision_tree(other); }),
              "learned affine bounds are of another surface; allowed: bounds over the tree's wide tree");
}

}  // namespace
}  // namespace nbd

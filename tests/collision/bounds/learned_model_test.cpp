#include "collision/bounds/learned/learned_model.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "collision/bounds/exact/exact_boxes.hpp"
#include "collision/bounds/learned/learned_boxes.hpp"
#include "collision/bounds/learned/learned_spheres.hpp"
#include "tests/collision/models.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

/// The sphere by the definition at LearnedModel, in double precision.
LearnedSphere reference(const LearnedModel& model, int node, const Vertices& x) {
    const LearnedModel::Node& n = model.nodes[static_cast<std::size_t>(node)];
    const int k = n.sample_count, h = LearnedModel::hidden;
    Eigen::MatrixX3d y(k, 3);
    for (int i = 0; i < k; ++i)
        y.row(i) = x.row(model.samples[static_cast<std::size_t>(n.sample_begin + i)]).cast<double>();
    const float* values = model.values.data() + n.value_begin;
    const auto take = [&](int rows, int cols) -> Eigen::MatrixXd {
        const Eigen::MatrixXd m = Eigen::Map<const Eigen::MatrixXf>(values, rows, cols).cast<double>();
        values += rows * cols;
        return m;
    };
    const Eigen::RowVector3d c = take(k, 1).transpose() * y;
    const Eigen::VectorXd d = (y.rowwise() - c).rowwise().norm();
    const Eigen::VectorXd mean = take(k, 1), inverse_deviation = take(k, 1);
    const double ood_score = (d.cwiseAbs2() - mean).cwiseAbs().cwiseProduct(inverse_deviation).maxCoeff();
    const LearnedModel::Reach reach = model.reach(node);
    double growth = reach.growth;
    if (model.network) {
        const Eigen::MatrixXd W1 = take(h, k), b1 = take(h, 1), W2 = take(h, h), b2 = take(h, 1),
                              w3 = take(h, 1);
        const Eigen::VectorXd h1 = (W1 * d + b1).cwiseMax(0), h2 = (W2 * h1 + b2).cwiseMax(0);
        growth = std::clamp(growth + w3.col(0).dot(h2), double{reach.low}, double{reach.high});
    }
    return {{c.transpose().cast<float>(), static_cast<float>(d.maxCoeff() + growth)},
            static_cast<float>(ood_score)};
}

struct LearnedModelTest : testing::Test {
    shapes::Surface s = shapes::torus(30, 14);
    SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 5});
    std::mt19937 random{1};

    Vertices pose(float reach) {
        return shapes::moved(shapes::wobbled(s.X, random, 0.1f), shapes::random_motion(random, reach));
    }
};

TEST_F(LearnedModelTest, SphereFollowsItsEquations) {
    for (const bool network : {false, true}) {
        const LearnedModel model = shapes::random_learned_model(tree, network, 2);
        check_learned_model(model, tree, static_cast<int>(s.X.rows()));
        LearnedSpheres bound(model);
        const Vertices x = pose(1);
        bound.begin_pose(x);
        int clamped = 0, inside = 0;
        for (int i = 0; i < static_cast<int>(tree.nodes.size()); ++i) {
            const LearnedSphere learned = reference(model, i, x);
            const Sphere expected = learned.sphere, sphere = bound.bound(i);
            EXPECT_NEAR(bound.ood_score(i), learned.ood_score, 2e-5 * learned.ood_score + 1e-6) << i;
            EXPECT_NEAR((sphere.c - expected.c).norm(), 0, 1e-6) << i;
            EXPECT_NEAR(sphere.r, expected.r, 2e-6) << i;
            const LearnedModel::Reach reach = model.reach(i);
            float most = 0;
            for (int k = 0; k < model.nodes[static_cast<std::size_t>(i)].sample_count; ++k) {
                const int v = model.samples[static_cast<std::size_t>(
                    model.nodes[static_cast<std::size_t>(i)].sample_begin + k)];
                most = std::max(most, (x.row(v).transpose() - sphere.c).norm());
            }
            const float growth = sphere.r - most;
            (growth < reach.low + 1e-5f || growth > reach.high - 1e-5f ? clamped : inside) += 1;
        }
        EXPECT_TRUE(!network || (clamped > 5 && inside > 5)) << clamped << ' ' << inside;
    }
}

TEST_F(LearnedModelTest, BoxIsTheSamplesBoxGrownByAShareOfTheirSpread) {
    const LearnedModel model = shapes::random_learned_model(tree, true, 2);
    const float margin = 0.03f;
    LearnedBoxes bound(tree, model, {std::vector<float>(tree.nodes.size(), margin), {}});
    const Vertices x = pose(1);
    bound.begin_pose(x);
    for (int i = 0; i < static_cast<int>(tree.nodes.size()); ++i) {
        const std::span<const int> samples = model.node_samples(i);
        const Eigen::MatrixX3d p =
            x(std::vector<int>(samples.begin(), samples.end()), Eigen::all).cast<double>();
        const Eigen::RowVector3d mean = p.colwise().mean();
        const double spread = std::sqrt((p.rowwise() - mean).rowwise().squaredNorm().mean());
        const double growth = (0.05 + double{margin}) * spread;
        const Box box = bound.box(i);
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_NEAR(box.lo[axis], p.col(axis).minCoeff() - growth, 1e-5);
            EXPECT_NEAR(box.hi[axis], p.col(axis).maxCoeff() + growth, 1e-5);
        }
        EXPECT_EQ(box.lo[3], 0);
        EXPECT_EQ(box.hi[3], 0);
    }
    EXPECT_EQ(bound.bounded(), static_cast<int>(tree.nodes.size()));
}

TEST_F(LearnedModelTest, BoxesOfOutOfDistributionNodesAreExact) {
    const LearnedModel model = shapes::random_learned_model(tree, true, 2);
    const std::vector<float> none(tree.nodes.size(), 0.f);
    LearnedBoxes bound(tree, model, {none, none});
    ExactBoxes exact(tree);
    const Vertices x = pose(1);
    bound.begin_pose(x);
    exact.begin_pose(x);
    for (int i = 0; i < static_cast<int>(tree.nodes.size()); ++i) {
        EXPECT_TRUE((bound.box(i).lo == exact.box(i).lo).all() && (bound.box(i).hi == exact.box(i).hi).all());
        EXPECT_EQ(bound.out_of_range(), i + 1);
    }
}

TEST_F(LearnedModelTest, TreatsNonFinitePositionsAsOutOfDistribution) {
    const LearnedModel model = shapes::random_learned_model(tree, false, 2);
    LearnedSpheres bound(model);
    Vertices x = pose(1);
    x(model.samples[static_cast<std::size_t>(model.nodes[5].sample_begin)], 1) = NAN;
    bound.begin_pose(x);
    bound.bound(5);
    EXPECT_TRUE(std::isnan(bound.ood_score(5)));
}

TEST_F(LearnedModelTest, ReadsPositionsWithARowStride) {
    const LearnedModel model = shapes::random_learned_model(tree, true, 2);
    const Vertices x = pose(1);
    Eigen::Matrix<float, Eigen::Dynamic, 5, Eigen::RowMajor> wide(x.rows(), 5);
    wide.leftCols<3>() = x;
    const Eigen::Map<const Vertices, 0, Eigen::OuterStride<>> apart(wide.data(), x.rows(), 3,
                                                                    Eigen::OuterStride<>(5));
    for (int i = 0; i < static_cast<int>(tree.nodes.size()); ++i)
        EXPECT_EQ(learned_sphere(model, i, apart).sphere.r, learned_sphere(model, i, x).sphere.r);
}

TEST_F(LearnedModelTest, CheckReportsEachKindOfInvalidModel) {
    const LearnedModel whole = shapes::random_learned_model(tree, true, 2);
    const auto error = [&](auto&& spoil) {
        LearnedModel model = whole;
        spoil(model);
        return test::refusal([&] { check_learned_model(model, tree, 420); });
    };
    using M = LearnedModel;
    const auto reach = [](M& m, int node) {
        const M::Node& n = m.nodes[static_cast<std::size_t>(node)];
        return m.values.data() + n.value_begin + M::block_size(n.sample_count, true) - M::lanes;
    };
    EXPECT_EQ(error([](M&) {}), "");
    EXPECT_EQ(error([](M& m) { m.nodes.pop_back(); }), "learned bounds: has 62 nodes, but the tree has 63");
    EXPECT_EQ(error([](M& m) { m.samples[3] = 420; }),
              "learned bounds: sample vertex 420, but the surface has 420 vertices");
    EXPECT_EQ(error([](M& m) { m.nodes[2].sample_count = 12; }),
              "learned bounds: node 2 has 12 samples, allowed: multiples of 16 up to 128");
    EXPECT_EQ(error([](M& m) { m.nodes[2].sample_count = 144; }),
              "learned bounds: node 2 has 144 samples, allowed: multiples of 16 up to 128");
    EXPECT_EQ(error([](M& m) { m.nodes[1].value_begin = 0; }),
              "learned bounds: node 1 begins at sample 32 and value 0 instead of 32 and 928");
    EXPECT_EQ(error([](M& m) { m.samples.pop_back(); }).substr(0, 20), "learned bounds: has ");
    EXPECT_EQ(error([](M& m) { m.values.push_back(0); }).substr(0, 20), "learned bounds: has ");
    EXPECT_EQ(error([](M& m) { m.values[950] = NAN; }), "learned bounds: a number of node 1 is not finite");
    EXPECT_EQ(error([](M& m) { m.values[0] += 1; }).substr(0, 58),
              "learned bounds: the weights of the centre of node 0 sum to");
    EXPECT_EQ(error([](M& m) { m.values[70] = -1; }),
              "learned bounds: an inverse deviation of node 0 is negative");
    EXPECT_EQ(
        error([&](M& m) { reach(m, 4)[1] = 0.3f; }),
        "learned bounds: the reach of node 4 is 0.3 to 0.2, allowed: an ascending range from 0 or more");
    EXPECT_EQ(error([](M& m) { m.boxes[4].growth = -1; }),
              "learned bounds: the box of node 4 has a number -1, allowed: finite, 0 or more");
    EXPECT_EQ(error([](M& m) { m.boxes.pop_back(); }),
              "learned bounds: has boxes of 62 nodes instead of 63 or none");
}

}  // namespace
}  // namespace nbd

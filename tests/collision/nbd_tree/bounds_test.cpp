#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "collision/nbd_tree/bd_bound.hpp"
#include "collision/nbd_tree/exact_bound.hpp"
#include "collision/nbd_tree/nbd_bound.hpp"
#include "collision/tree/posed_tree.hpp"
#include "tests/collision/models.hpp"

namespace nbd {
namespace {

/// Largest distance of a listed vertex beyond the sphere, metres; <= 0 if the sphere contains them all.
double protrusion(const Sphere& s, const Vertices& x, std::span<const int> vertices) {
    double most = -s.r;
    for (const int v : vertices)
        most =
            std::max(most, (x.row(v).transpose().cast<double>() - s.c.cast<double>()).norm() - double{s.r});
    return most;
}

TEST(ExactBound, ContainsEveryVertexAndMatchesItsDefinitionAtAnyScaleAndOffset) {
    std::mt19937 random(1);
    const shapes::Surface surfaces[] = {shapes::torus(33, 17), shapes::bar(20, 7), shapes::sphere(2, 3)};
    for (const auto& s : surfaces)
        for (const int depth : {0, 3, 9}) {
            const SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = depth, .min_leaf_faces = 1});
            ExactBound bound(tree);
            for (const float scale : {1e-4f, 1.f, 1e3f})
                for (const float reach : {0.f, 1.f, 1e3f}) {
                    const Vertices x = scale * shapes::moved(shapes::wobbled(s.X, random, 0.2f),
                                                             shapes::random_motion(random, reach));
                    bound.begin_pose(x);
                    for (int i = 0; i < std::ssize(tree.nodes); ++i) {
                        const Sphere sphere = bound.bound(i),
                                     rule = bounding_sphere(x, tree.node_vertices(i));
                        EXPECT_LE(protrusion(sphere, x, tree.node_vertices(i)), 0);
                        const float rounding = 4e-7f * scale * (2 + reach);
                        EXPECT_NEAR((sphere.c - rule.c).norm(), 0, rounding);
                        EXPECT_NEAR(sphere.r, rule.r, rounding);
                    }
                }
        }
}

TEST(ExactBound, ReadsPositionsWithARowStride) {
    const auto s = shapes::torus(20, 10);
    const SphereTree tree = build_sphere_tree(s.X, s.F);
    Eigen::Matrix<float, Eigen::Dynamic, 5, Eigen::RowMajor> wide(s.X.rows(), 5);
    wide.leftCols<3>() = s.X;
    ExactBound dense(tree), apart(tree);
    dense.begin_pose(s.X);
    apart.begin_pose(Eigen::Map<const Vertices, 0, Eigen::OuterStride<>>(wide.data(), s.X.rows(), 3,
                                                                         Eigen::OuterStride<>(5)));
    for (int i = 0; i < std::ssize(tree.nodes); ++i) {
        EXPECT_EQ(dense.bound(i).c, apart.bound(i).c);
        EXPECT_EQ(dense.bound(i).r, apart.bound(i).r);
    }
}

/// Positions X + U q, moved rigidly: the poses for which BD-Trees are conservative.
struct SpanPose {
    Eigen::VectorXf q;
    RigidTransform motion;
    Vertices x;
};

SpanPose random_span_pose(const shapes::Surface& s, const shapes::Modes& modes, std::mt19937& random,
                          float amount) {
    SpanPose pose;
    pose.q = Eigen::VectorXf::NullaryExpr(modes.U.cols(),
                                          [&](Eigen::Index) { return amount * shapes::uniform(random); });
    pose.motion = shapes::random_motion(random, 2);
    pose.x = shapes::moved(shapes::nbd_pose(s, modes.U, pose.q), pose.motion);
    return pose;
}

TEST(BdBound, ContainsEveryVertexOfPosesInTheSpanOfTheModes) {
    std::mt19937 random(2);
    float largest_shift = 0;
    for (const auto& s : {shapes::torus(30, 14), shapes::bar(24, 10)})
        for (const int mode_count : {1, 6, 24}) {
            const shapes::Modes modes = shapes::make_modes(s, mode_count, 80, 3);
            const SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 6});
            const BdModel model = build_bd_model(tree, modes.U, modes.clustered);
            check_bd_model(model, tree, s.X.rows());
            BdBound bound(tree, model);
            for (int i = 0; i < 10; ++i) {
                const SpanPose pose =
                    random_span_pose(s, modes, random, 0.6f / std::sqrt(static_cast<float>(mode_count)));
                largest_shift = std::max(
                    largest_shift, (pose.x - shapes::moved(s.X, pose.motion)).rowwise().norm().maxCoeff());
                bound.begin_pose(pose.x);
                for (int node = 0; node < std::ssize(tree.nodes); ++node)
                    EXPECT_LE(protrusion(bound.bound(node), pose.x, tree.node_vertices(node)), 0)
                        << mode_count << " modes, node " << node;
            }
        }
    EXPECT_GT(largest_shift, 0.3f);
}

TEST(BdBound, FollowsItsEquations) {
    std::mt19937 random(4);
    const auto s = shapes::bar(24, 10);
    const shapes::Modes modes = shapes::make_modes(s, 5, 60, 3);
    const SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 4});
    const BdModel model = build_bd_model(tree, modes.U, modes.clustered);
    BdBound bound(tree, model);
    for (const float amount : {0.f, 0.3f}) {  // at rest, too
        const SpanPose pose = random_span_pose(s, modes, random, amount);
        bound.begin_pose(pose.x);
        for (int i = 0; i < std::ssize(tree.nodes); ++i) {
            const std::span<const int> vertices = tree.node_vertices(i);
            Eigen::VectorXd mean = Eigen::VectorXd::Zero(3);
            for (const int v : vertices)
                mean += (modes.U.middleRows<3>(3 * v) * pose.q).cast<double>() /
                        static_cast<double>(vertices.size());
            double r = tree.rest[i].r;
            for (int j = 0; j < 5; ++j) {
                Eigen::Vector3f column = Eigen::Vector3f::Zero();
                for (const int v : vertices)
                    column += modes.U.col(j).segment<3>(3 * v) / static_cast<float>(vertices.size());
                float dr = 0;
                for (const int v : vertices)
                    dr = std::max(dr, (modes.U.col(j).segment<3>(3 * v) - column).norm());
                r += dr * std::abs(pose.q[j]);
            }
            const Eigen::Vector3f c = tree.rest[i].c + mean.cast<float>();
            EXPECT_NEAR((bound.bound(i).c - (pose.motion.R * c + pose.motion.t)).norm(), 0, 1e-5);
            EXPECT_NEAR(bound.bound(i).r, r, 1e-5);
        }
    }
}

struct NbdBoundTest : testing::Test {
    shapes::Surface s = shapes::torus(20, 12);
    shapes::Modes modes = shapes::make_modes(s, 9, 50, 3);
    SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 3});
    NbdModel model = shapes::random_model(tree, modes.clustered, 32, 6);
};

TEST_F(NbdBoundTest, EqualsTheNetworksSphereInWorldSpace) {
    std::mt19937 random(5);
    const int nodes = tree.nodes.size();
    model.centre_map = FixedMatrix(Eigen::MatrixXf::NullaryExpr(
        9, 3 * nodes, [&](Eigen::Index, Eigen::Index) { return 0.1f * shapes::uniform(random); }));
    NbdBound bound(tree, model);
    for (int round = 0; round < 2; ++round) {
        const SpanPose pose = random_span_pose(s, modes, random, 0.3f);
        bound.begin_pose(pose.x);
        ModalCoordinatesScratch scratch;
        Eigen::VectorXf z(9);
        const RigidTransform align = modal_coordinates(modes.clustered, pose.x, scratch, z);
        const FixedVector zn = shapes::fixed((z - model.z_centre).cwiseProduct(model.z_scale));
        for (int k = 0; k < nodes; ++k) {
            const int i = round == 0 ? k : nodes - 1 - k;  // siblings in either order
            const Sphere expected = shapes::nbd_sphere(model, tree, i, zn);
            EXPECT_NEAR((bound.bound(i).c - (align.R * expected.c + align.t)).norm(), 0, 1e-6);
            EXPECT_EQ(bound.bound(i).r, expected.r);
        }
    }
}

TEST_F(NbdBoundTest, IsNanForPosesWithNonFinitePositions) {
    NbdBound bound(tree, model);
    for (const float bad : {NAN, INFINITY}) {
        Vertices x = s.X;
        x(modes.clustered.representatives[7], 1) = bad;
        bound.begin_pose(x);
        for (int i = 0; i < std::ssize(tree.nodes); ++i) {
            const Sphere sphere = bound.bound(i);
            EXPECT_TRUE(std::isnan(sphere.c[0]) && std::isnan(sphere.r));
            EXPECT_FALSE(bound.ood_score(i) <= 1e30f);
        }
    }
}

TEST_F(NbdBoundTest, ScoresModalCoordinatesAndRepresentativesOutsideTheSphere) {
    std::mt19937 random(8);
    for (Eigen::Index i = 0; i < model.out_centre.cols(); i += 2)
        model.out_centre(3, i) += 1;  // large enough to hold every representative
    model.z_mean = Eigen::VectorXf::LinSpaced(9, -0.2f, 0.1f);
    model.z_whitening = Eigen::MatrixXf::NullaryExpr(
        9, 9, [&](Eigen::Index, Eigen::Index) { return shapes::uniform(random); });
    NbdModel unmeasured = model;
    unmeasured.z_mean.resize(0);
    unmeasured.z_whitening.resize(0, 0);
    NbdBound bound(tree, model), outside_alone(tree, unmeasured);
    const Vertices x = shapes::wobbled(s.X, random, 0.2f);
    ModalCoordinatesScratch scratch;
    Eigen::VectorXf z(9);
    modal_coordinates(modes.clustered, x, scratch, z);
    const Eigen::VectorXf zn = (z - model.z_centre).cwiseProduct(model.z_scale);
    const float code = (model.z_whitening * (zn - model.z_mean)).norm() / 3;
    EXPECT_GT(code, 0.1f);
    bound.begin_pose(x);
    outside_alone.begin_pose(x);
    int with_some = 0, with_none = 0;
    for (int i = 0; i < std::ssize(tree.nodes); ++i) {
        const Sphere sphere = bound.bound(i);
        const auto vertices = tree.node_vertices(i);
        float farthest = sphere.r;
        for (const int v : modes.clustered.representatives)
            if (std::ranges::find(vertices, v) != vertices.end())
                farthest = std::max(farthest, (x.row(v).transpose() - sphere.c).norm());
        const float outside = 20 * (farthest / sphere.r - 1);
        ++(outside > 0 ? with_some : with_none);
        EXPECT_NEAR(bound.ood_score(i), code + outside, 1e-4f * (code + outside)) << i;
        outside_alone.bound(i);
        EXPECT_NEAR(outside_alone.ood_score(i), outside, 1e-4f * (1 + outside)) << i;
    }
    EXPECT_GT(with_some, 2);
    EXPECT_GT(with_none, 2);
    for (NbdBound* b : {&bound, &outside_alone}) {
        b->begin_pose(Vertices::Constant(s.X.rows(), 3, NAN));
        b->bound(3);
        EXPECT_TRUE(std::isnan(b->ood_score(3)));
    }
}

TEST(Bounds, AreEquivariantUnderRigidMotion) {
    std::mt19937 random(7);
    const auto s = shapes::torus(30, 14);
    const auto tree = shapes::shared_full_tree(s, 12, 90, 3);
    for (const BoundKind kind : shapes::kinds_of(*tree)) {
        // Boxes, and the spheres around them, depend on the body's orientation.
        if (is_box(kind)) continue;
        PosedTree here(tree, kind), there(tree, kind);
        for (int i = 0; i < 5; ++i) {
            const Vertices x = shapes::wobbled(s.X, random, 0.1f);
            const RigidTransform motion = shapes::random_motion(random, 2);
            const Vertices y = shapes::moved(x, motion);
            here.begin_pose(x);
            there.begin_pose(y);
            for (int node = 0; node < std::ssize(tree->spheres.nodes); ++node) {
                const Sphere expected = to_world(motion, here.sphere(node));
                // Rounding errors turn with the body, and NBD bounds round to few bits.
                const float tolerance = kind == BoundKind::nbd ? 1e-3f : 3e-5f;
                EXPECT_NEAR((there.sphere(node).c - expected.c).norm(), 0, tolerance) << name(kind);
                EXPECT_NEAR(there.sphere(node).r, expected.r, tolerance) << name(kind);
            }
        }
    }
}

}  // namespace
}  // namespace nbd

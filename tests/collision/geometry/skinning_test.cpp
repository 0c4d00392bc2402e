#include "collision/geometry/skinning.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"
#include "tests/support/brute_force.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

/// A bar along z with bones along it; each vertex follows those around it.
struct SkinnedBar {
    shapes::Surface surface = shapes::bar(40, 16);  // more than two patches
    SurfaceEmbedding weights;

    explicit SkinnedBar(int bones, float reach = 1.5f) : weights(surface.X.rows(), bones) {
        std::vector<Eigen::Triplet<float>> entries;
        for (int v = 0; v < surface.X.rows(); ++v) {
            std::vector<float> pull(bones);
            float sum = 0;
            for (int k = 0; k < bones; ++k) {
                const float along = (surface.X(v, 2) / 1.2f + 0.5f) * static_cast<float>(bones) - 0.5f -
                                    static_cast<float>(k);
                sum += pull[k] = std::max(0.f, reach - std::abs(along));
            }
            for (int k = 0; k < bones; ++k)
                if (pull[k] > 0) entries.emplace_back(v, k, pull[k] / sum);
        }
        weights.setFromTriplets(entries.begin(), entries.end());
    }

    /// The definition: x = sum_k w_k M_k [X; 1], in double precision.
    Eigen::MatrixX3d skinned(const std::vector<BoneTransform>& bones) const {
        Eigen::MatrixX3d x = Eigen::MatrixX3d::Zero(surface.X.rows(), 3);
        for (int v = 0; v < x.rows(); ++v)
            for (SurfaceEmbedding::InnerIterator entry(weights, v); entry; ++entry) {
                const Eigen::Matrix<double, 3, 4> M = bones[entry.col()].cast<double>();
                const Eigen::Vector3d X = surface.X.row(v).transpose().cast<double>();
                x.row(v) += double{entry.value()} * (M.leftCols<3>() * X + M.col(3)).transpose();
            }
        return x;
    }
};

std::vector<BoneTransform> random_bones(int count, std::mt19937& random, float bend) {
    std::vector<BoneTransform> bones;
    for (int k = 0; k < count; ++k) {
        BoneTransform M = BoneTransform::Identity();
        for (float& entry : M.reshaped()) entry += bend * shapes::uniform(random);
        bones.push_back(M);
    }
    return bones;
}

TEST(Skinning, GivesTheSkinnedPositions) {
    std::mt19937 random(1);
    for (const int count : {1, 3, 6, 20}) {
        const SkinnedBar bar(count, count == 20 ? 4.f : 1.5f);
        const Skinning skin(bar.surface.X, bar.weights);
        ASSERT_EQ(skin.bone_count(), count);
        EXPECT_LE((embedded(skin.embedding(), skin.rest_nodes()) - bar.surface.X).cwiseAbs().maxCoeff(),
                  3e-6);
        Vertices nodes;
        for (int pose = 0; pose < 10; ++pose) {
            const auto bones = random_bones(count, random, 0.4f);
            skin.pose(bones, nodes);
            const Eigen::MatrixX3d error =
                embedded(skin.embedding(), nodes).cast<double>() - bar.skinned(bones);
            EXPECT_LE(error.cwiseAbs().maxCoeff(), 3e-6) << count << " bones";
        }
    }
}

TEST(Skinning, BoundsABodyThatFollowsItsBones) {
    std::mt19937 random(2);
    const SkinnedBar bar(6, 2.5f);
    const Skinning skin(bar.surface.X, bar.weights);
    CollisionTree tree = make_exact_tree(bar.surface.X, bar.surface.F);
    hang_on_nodes(tree, skin.embedding(), skin.rest_nodes());
    const auto shared = std::make_shared<const CollisionTree>(std::move(tree));
    PosedTree a(shared, BoundKind::affine), b(shared, BoundKind::affine);
    PairQuery query;
    SelfQuery self;
    std::size_t found = 0;
    const Faces& F = bar.surface.F;
    for (int pose = 0; pose < 8; ++pose) {
        Vertices nodes_a, nodes_b;
        skin.pose(random_bones(6, random, 0.3f), nodes_a);
        skin.pose(random_bones(6, random, 0.3f), nodes_b);
        const Vertices x = embedded(skin.embedding(), nodes_a), y = embedded(skin.embedding(), nodes_b);
        a.begin_pose_of_nodes(nodes_a);
        b.begin_pose_of_nodes(nodes_b);
        const auto expected = test::brute_force_intersecting(x, F, y, F);
        const auto pairs = query.intersecting(a, b);
        EXPECT_EQ(std::vector<FacePair>(pairs.begin(), pairs.end()), expected);
        found += expected.size();
        for (const FacePair& pair : self.intersecting(a))
            EXPECT_EQ(test::brute_force_intersecting(x, F.row(pair.a), x, F.row(pair.b)).size(), 1u);
    }
    EXPECT_GT(found, 1000u);
}

TEST(Skinning, HoldsEveryVertexInTheTetrahedraOfItsBones) {
    // Bones with one vertex, two and three.
    Vertices X(9, 3);
    X << 0, 0, 0, 1, 0, 0, 5, 5, 5, 5, 5, 6, 8, 0, 0, 8, 1, 0, 8, 0, 2, 1e-3f, 0, 0, 900, 900, 900;
    SurfaceEmbedding weights(9, 5);
    for (int v = 0; v < 9; ++v) weights.insert(v, v < 2 ? 4 : v < 4 ? 1 : v < 7 ? 0 : v < 8 ? 4 : 3) = 1;
    const Skinning skin(X, weights);
    EXPECT_TRUE(skin.rest_nodes().allFinite());
    EXPECT_GE(
        Eigen::Map<const Eigen::ArrayXf>(skin.embedding().valuePtr(), skin.embedding().nonZeros()).minCoeff(),
        0);
    EXPECT_LE((embedded(skin.embedding(), skin.rest_nodes()) - X).cwiseAbs().maxCoeff(), 1e-4);
    CollisionTree tree = make_exact_tree(X, Eigen::RowVector3i(0, 1, 2));
    EXPECT_EQ(test::error_of([&] { hang_on_nodes(tree, skin.embedding(), skin.rest_nodes()); }), "");
}

TEST(Skinning, RefusesAnotherNumberOfBones) {
    const SkinnedBar bar(5);
    const Skinning skin(bar.surface.X, bar.weights);
    Vertices nodes;
    EXPECT_EQ(
        test::refusal([&] { skin.pose(std::vector<BoneTransform>(4, BoneTransform::Identity()), nodes); }),
        "4 bone transforms; allowed: one for each of the 5 bones");
}

TEST(Skinning, RefusesWeightsThatAreNone) {
    const Vertices X = shapes::bar(4, 5).X;
    SurfaceEmbedding weights(X.rows(), 12);
    for (int v = 0; v < X.rows(); ++v) weights.insert(v, v % 12) = 1;
    const auto error = [&](int vertex, int bone, float weight) {
        SurfaceEmbedding changed = weights;
        changed.coeffRef(vertex, bone) = weight;
        return test::error_of([&] { Skinning(X, changed); });
    };
    EXPECT_EQ(error(3, 3, 1), "");
    EXPECT_EQ(error(3, 4, -0.1f), "vertex 3 has the bone weight -0.1; allowed: finite, 0 or more");
    EXPECT_EQ(error(5, 4, std::numeric_limits<float>::infinity()),
              "vertex 5 has the bone weight inf; allowed: finite, 0 or more");
    EXPECT_EQ(error(5, 4, std::numeric_limits<float>::quiet_NaN()),
              "vertex 5 has the bone weight nan; allowed: finite, 0 or more");
    EXPECT_EQ(error(2, 2, 0.5f), "the bone weights of vertex 2 sum to 0.5; allowed: 1, within 5e-06");
    SurfaceEmbedding many = weights;
    for (int k = 0; k < 9; ++k) many.coeffRef(7, k) = 1 / 9.f;
    EXPECT_EQ(test::error_of([&] { Skinning(X, many); }), "vertex 7 has 9 bone weights; allowed: at most 8");
    EXPECT_EQ(test::error_of([&] { Skinning(X.topRows(4), weights); }),
              "the bone weights have 22 rows; allowed: one for each of the 4 vertices");
    Vertices broken = X;
    broken(6, 1) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(test::error_of([&] { Skinning(broken, weights); }), "vertex 6 is not finite");
}

}  // namespace
}  // namespace nbd

#include "collision/geometry/embedding.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "collision/base/counter_random.hpp"
#include "collision/geometry/embedded_positions.hpp"
#include "collision/geometry/tet_mesh.hpp"

namespace nbd {
namespace {

/// Vertex v hangs on v % 5 of the nodes.
template <class Scalar>
EmbeddingOf<Scalar> random_embedding(int vertices, int nodes) {
    std::vector<Eigen::Triplet<Scalar>> entries;
    for (int v = 0; v < vertices; ++v)
        for (int k = 0; k < v % 5; ++k)
            entries.emplace_back(v, (7 * v + 11 * k) % nodes,
                                 static_cast<Scalar>(counter_uniform(1, static_cast<std::uint64_t>(v),
                                                                     static_cast<std::uint64_t>(k))));
    EmbeddingOf<Scalar> W(vertices, nodes);
    W.setFromTriplets(entries.begin(), entries.end());
    return W;
}

TEST(Embedding, GivesTheBitsOfEigensProductInDoublePrecision) {
    const Embedding W = random_embedding<double>(1000, 97);
    const Nodes nodes = Nodes::Random(97, 3);
    EXPECT_EQ(embedded(W, nodes), Nodes(W * nodes));
    ASSERT_GT(embedded(W, nodes).cwiseAbs().maxCoeff(), 1);
}

TEST(Embedding, GivesTheSameBitsForAllVerticesAndForOneAtATime) {
    const SurfaceEmbedding W = random_embedding<float>(1000, 97);
    const Vertices nodes = Vertices::Random(97, 3), all = embedded(W, nodes);
    const auto entries = static_cast<std::size_t>(W.nonZeros());
    EmbeddedPositions x({W.outerIndexPtr(), 1001}, {W.innerIndexPtr(), entries}, {W.valuePtr(), entries}, 97);
    x.begin_pose(nodes);
    std::vector<int> backward(1000);
    std::iota(backward.rbegin(), backward.rend(), 0);
    x.compute(backward);
    EXPECT_EQ(Vertices(x.rows()), all);
    for (int v = 0; v < 1000; ++v) {
        Eigen::RowVector3f sum = Eigen::RowVector3f::Zero();
        for (SurfaceEmbedding::InnerIterator entry(W, v); entry; ++entry)
            for (int axis = 0; axis < 3; ++axis) {
                const volatile float product = entry.value() * nodes(entry.col(), axis);  // is not fused
                sum[axis] += product;
            }
        EXPECT_EQ(all.row(v), sum);
    }
}

TEST(Embedding, TakesWeightsWithRoomBetweenRows) {
    SurfaceEmbedding W = random_embedding<float>(50, 20);
    const Vertices nodes = Vertices::Random(20, 3), x = embedded(W, nodes);
    W.reserve(Eigen::VectorXi::Constant(50, 3));
    ASSERT_FALSE(W.isCompressed());
    EXPECT_EQ(embedded(W, nodes), x);
}

}  // namespace
}  // namespace nbd

#include "collision/geometry/embedding.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "collision/base/counter_random.hpp"
#include "collision/geometry/tet_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

/// Vertex v hangs on v % 5 of the nodes.
template <class Scalar>
EmbeddingOf<Scalar> random_embedding(int vertices, int nodes) {
    std::vector<Eigen::Triplet<Scalar>> entries;
    for (int v = 0; v < vertices; ++v)
        for (int k = 0; k < v % 5; ++k)
            entries.emplace_back(v, (7 * v + 11 * k) % nodes,
                                 static_cast<Scalar>(counter_uniform(1, static_cast<std::uint64_t>(v), k)));
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
    for (int v = 0; v < 1000; ++v) {
        const int begin = W.outerIndexPtr()[v], count = W.outerIndexPtr()[v + 1] - begin;
        EXPECT_EQ(embedded_position(count, W.innerIndexPtr() + begin, W.valuePtr() + begin, nodes.data(), 3),
                  all.row(v));
        Eigen::RowVector3f sum = Eigen::RowVector3f::Zero();
        for (SurfaceEmbedding::InnerIterator entry(W, v); entry; ++entry)
            for (int axis = 0; axis < 3; ++axis) {
                const volatile float product = entry.value() * nodes(entry.col(), axis);  // is not fused
                sum[axis] += product;
            }
        EXPECT_EQ(all.row(v), sum);
    }
}

TEST(Embedding, IsMadeOfCompressedRowsThatFit) {
    const std::vector<int> begin{0, 2, 2, 3}, columns{1, 4, 0};
    const std::vector<float> weights{0.25f, 0.75f, 1};
    const SurfaceEmbedding W = embedding_of_rows(begin, columns, weights, 5);
    ASSERT_EQ(W.rows(), 3);
    ASSERT_EQ(W.cols(), 5);
    EXPECT_EQ(W.nonZeros(), 3);
    EXPECT_EQ(W.coeff(0, 4), 0.75f);
    EXPECT_EQ(W.coeff(2, 0), 1);
    const auto error = [&](std::vector<int> changed_begin, std::vector<int> changed_columns, int nodes = 5) {
        return test::error_of([&] { embedding_of_rows(changed_begin, changed_columns, weights, nodes); });
    };
    EXPECT_EQ(error(begin, columns, 4), "an embedding refers to node 4, but the node count is 4");
    EXPECT_EQ(error(begin, {1, -1, 0}), "an embedding refers to node -1, but the node count is 5");
    EXPECT_EQ(error(begin, {4, 4, 0}),
              "row 0 of an embedding refers to node 4 after node 4; allowed: ascending");
    const std::string rows =
        "the row offsets of an embedding must start at 0, ascend and end at its number of columns and "
        "weights; there are 3 columns and 3 weights";
    for (const std::vector<int>& bad : {std::vector<int>{}, {1, 2, 2, 3}, {0, 3, 2, 3}, {0, 2, 2, 4}})
        EXPECT_EQ(error(bad, columns), rows);
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

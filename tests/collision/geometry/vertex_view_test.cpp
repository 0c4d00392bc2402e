#include "collision/geometry/vertex_view.hpp"

#include <gtest/gtest.h>

#include <type_traits>
#include <utility>

#include "collision/query/pair_query.hpp"
#include "collision/wide_tree/posed_wide_tree.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

using Columns = Eigen::MatrixX3f;
using Doubles = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Wide = Eigen::Matrix<float, Eigen::Dynamic, 5, Eigen::RowMajor>;
using RowMap = Eigen::Map<const Vertices>;
using StridedMap = Eigen::Map<Vertices, 0, Eigen::OuterStride<>>;
using SpacedMap = Eigen::Map<const Vertices, 0, Eigen::Stride<Eigen::Dynamic, 2>>;
using CastOfColumns = decltype(std::declval<Columns&>().cast<float>());
using CastOfDoubles = decltype(std::declval<Doubles&>().cast<float>());
using Sum = decltype(std::declval<Vertices&>() + std::declval<Vertices&>());
using Block = decltype(std::declval<Wide&>().leftCols<3>());

/// Everything that keeps the address of positions.
template <class X>
concept Kept = std::is_constructible_v<VertexView, X> || requires(PosedTree& tree, X&& x) {
    tree.begin_pose(std::forward<X>(x));
} || requires(PosedTree& tree, X&& x) {
    tree.begin_pose_of_nodes(std::forward<X>(x));
} || requires(PosedTree& tree, X&& x, const Vertices& y) {
    tree.begin_step(std::forward<X>(x), y);
} || requires(PosedTree& tree, X&& x, const Vertices& y) {
    tree.begin_step(y, std::forward<X>(x));
} || requires(PosedTree& tree, X&& x, const Vertices& y) {
    tree.begin_step_of_nodes(std::forward<X>(x), y);
} || requires(PosedTree& tree, X&& x, const Vertices& y) {
    tree.begin_step_of_nodes(y, std::forward<X>(x));
} || requires(PosedWideTree& boxes, X&& x) {
    boxes.begin_pose(std::forward<X>(x));
} || requires(PosedWideTree& boxes, X&& x, const Vertices& y) {
    boxes.begin_step(std::forward<X>(x), y);
};

// Each of these would be copied, and the copy freed before the first query.
static_assert(!Kept<Columns&> && !Kept<const Columns&>, "columns that follow each other");
static_assert(!Kept<CastOfColumns> && !Kept<CastOfDoubles> && !Kept<Sum>, "expressions");
static_assert(!Kept<Doubles&> && !Kept<const Eigen::MatrixXf&>, "other numbers, another number of columns");
static_assert(!Kept<Vertices> && !Kept<const Vertices>, "temporary matrices");
static_assert(!Kept<Block> && !Kept<SpacedMap&>, "blocks, which may be of temporaries; spaced numbers");
static_assert(!Kept<VerticesRef&> && !Kept<const VerticesRef&> && !Kept<VerticesRef>,
              "references that may hold a copy of their own");
static_assert(!Kept<Eigen::Map<const Columns>>, "columns of memory");
template <class X>
concept Lent = requires(X&& x) {
    VertexView::as_long_as(std::forward<X>(x));
};
static_assert(Lent<const VerticesRef&> && !Lent<Vertices&> && !Lent<Columns&> && !Lent<VerticesRef>);

static_assert(Kept<Vertices&> && Kept<const Vertices&> && Kept<RowMap> && Kept<RowMap&> && Kept<StridedMap>);
static_assert(Kept<Eigen::Ref<Vertices>> && Kept<VertexView>);

template <class Tree>
concept Referred = requires(Tree&& tree) {
    refer_to(std::forward<Tree>(tree));
};
static_assert(Referred<CollisionTree&> && Referred<const CollisionTree&> && !Referred<CollisionTree>);

TEST(VertexView, RefersToTheCallersRows) {
    Wide wide = Wide::Random(4, 5);
    const StridedMap rows(wide.data(), 4, 3, Eigen::OuterStride<>(5));
    for (const VertexView& view : {VertexView(rows), VertexView(wide.data(), 4, 5)}) {
        EXPECT_EQ(view.data(), wide.data());
        EXPECT_EQ(Vertices(view.rows()), Vertices(wide.leftCols<3>()));
    }
    const Vertices one = Vertices::Random(1, 3), none(0, 3);
    EXPECT_EQ(Vertices(VertexView(one).rows()), one);
    EXPECT_EQ(VertexView(none).count(), 0);
}

TEST(VertexView, RefusesRowsThatOverlapAndMissingArrays) {
    const float x[6] = {};
    EXPECT_EQ(
        test::refusal([&] { VertexView(x, 2, 2); }),
        "positions: an array of 2 rows, 2 numbers apart; allowed: an array, or no rows, at least 3 numbers "
        "apart");
    EXPECT_EQ(
        test::refusal([&] { VertexView(nullptr, 2); }),
        "positions: no array of 2 rows, 3 numbers apart; allowed: an array, or no rows, at least 3 numbers "
        "apart");
    EXPECT_EQ(
        test::refusal([&] { VertexView(x, -1); }),
        "positions: an array of -1 rows, 3 numbers apart; allowed: an array, or no rows, at least 3 numbers "
        "apart");
    EXPECT_EQ(VertexView(nullptr, 0).count(), 0);
}

}  // namespace
}  // namespace nbd

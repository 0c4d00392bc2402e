#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "sim/factor/sweep_matrix.hpp"
#include "sim/fem/elastic_body.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

struct Pattern {
    std::vector<int> offset{0}, column;

    Pattern() {
        const ElasticBody body(test::box_mesh({3, 1, 1}, {12, 4, 4}), Material{});
        for (int i = 0; i < body.node_count(); ++i) {
            const auto row = body.pattern().neighbours(i);
            column.insert(column.end(), row.begin(), row.end());
            offset.push_back(column.size());
        }
    }
    int rows() const { return static_cast<int>(offset.size()) - 1; }
    std::span<const int> columns_of(int i) const {
        return std::span(column).subspan(offset[i], offset[static_cast<std::size_t>(i) + 1] - offset[i]);
    }
};

/// The turn of each row in a sweep.
std::vector<int> turns(const SweepOrder& order) {
    std::vector<int> turn(order.rows(), -1);
    int next = 0;
    for (const auto& colour : order.colours)
        for (const RowRange& part : colour)
            for (int i = part.begin; i < part.end; ++i) turn[i] = next++;
    return turn;
}

TEST(SweepOrder, HasEveryRowOnce) {
    const Pattern pattern;
    const SweepOrder order(pattern.offset, pattern.column, 16);
    std::vector<int> turn = turns(order);
    std::ranges::sort(turn);
    std::vector<int> all(pattern.rows());
    std::iota(all.begin(), all.end(), 0);
    EXPECT_EQ(turn, all);
}

TEST(SweepOrder, PartsOfAColourAreNotCoupled) {
    const Pattern pattern;
    const SweepOrder order(pattern.offset, pattern.column, 16);
    ASSERT_GT(order.colours.size(), 1U);
    ASSERT_TRUE(std::ranges::any_of(order.colours, [](const auto& parts) { return parts.size() > 1; }));
    for (const auto& colour : order.colours)
        for (const RowRange& part : colour)
            for (int i = part.begin; i < part.end; ++i)
                for (const int j : pattern.columns_of(i))
                    for (const RowRange& other : colour)
                        EXPECT_FALSE(other.begin != part.begin && j >= other.begin && j < other.end);
}

TEST(SweepOrder, SplitsTheColumnsOfARowByTheirTurn) {
    const Pattern pattern;
    const SweepOrder order(pattern.offset, pattern.column, 16);
    const std::vector<int> turn = turns(order);
    EXPECT_EQ(order.column.size(), pattern.column.size() - static_cast<std::size_t>(pattern.rows()));
    for (int row = 0; row < pattern.rows(); ++row) {
        const std::size_t i = row;
        const auto turn_at = [&](int k) { return turn[order.column[k]]; };
        for (int k = order.earlier[i] + 1; k < order.earlier[i + 1]; ++k)
            EXPECT_LT(turn_at(k - 1), turn_at(k));
        for (int k = order.later[i] + 1; k < order.later[i + 1]; ++k) EXPECT_GT(turn_at(k - 1), turn_at(k));
        const auto ascending = pattern.columns_of(row);
        for (std::size_t k = 0; k < ascending.size(); ++k) {
            const int place = order.place[static_cast<std::size_t>(order.offset[i]) + k];
            if (ascending[k] == row) {
                EXPECT_EQ(place, -1);
                continue;
            }
            ASSERT_GE(place, 0);
            EXPECT_EQ(order.column[place], ascending[k]);
            const auto& half = turn[ascending[k]] < turn[i] ? order.earlier : order.later;
            EXPECT_TRUE(half[i] <= place && place < half[i + 1]);
        }
    }
}

}  // namespace
}  // namespace nbd

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "collision/kernels/box_pack.hpp"
#include "collision/kernels/kernels.hpp"
#include "tests/collision/models.hpp"

namespace nbd {
namespace {

constexpr int point_count = 24;

/// Points with four numbers each, of which the last is not finite, and lists of places of some of them.
class PointKernels : public testing::TestWithParam<InstructionSet> {
 protected:
    void SetUp() override {
        form = kernels_for(GetParam());
        if (!form) GTEST_SKIP() << "the CPU does not support this instruction set";
    }

    /// In some rounds, one coordinate is not finite.
    std::vector<float> points(int round) {
        std::vector<float> x(4 * point_count);
        for (std::size_t i = 0; i < x.size(); ++i) x[i] = i % 4 == 3 ? nan : shapes::uniform(random);
        if (round % 3 == 0) x[4 * (random() % point_count) + random() % 3] = round % 2 == 0 ? inf : nan;
        return x;
    }
    std::int32_t place() { return 4 * (random() % point_count); }

    /// Expects the box around points. Returns whether all of these are finite.
    template <class Places>
    static bool expect_box(const Box& box, const std::vector<float>& x, const Places& places) {
        Box expected = empty_box();
        bool finite = true;
        for (const std::int32_t place : places) {
            const float* p = x.data() + place;
            const Eigen::Array4f point(p[0], p[1], p[2], 0);
            finite &= point.isFinite().all();
            expected = joined(expected, {point, point});
        }
        if (finite) {
            EXPECT_TRUE((box.lo == expected.lo).all() && (box.hi == expected.hi).all());
        }
        return finite;
    }

    static constexpr float inf = std::numeric_limits<float>::infinity(),
                           nan = std::numeric_limits<float>::quiet_NaN();
    const Kernels& plain = *kernels_for(InstructionSet::plain);
    const Kernels* form = nullptr;
    std::mt19937 random{1};
    int not_finite = 0;
};

TEST_P(PointKernels, BoundAList) {
    for (int round = 0; round < 2000; ++round) {
        const std::vector<float> x = points(round);
        std::vector<std::int32_t> places(static_cast<std::size_t>(round % 21));
        for (std::int32_t& place : places) place = this->place();
        const int count = places.size();
        Box found, own;
        const bool finite = form->box_of_points(x.data(), places.data(), count, numbers(found));
        EXPECT_EQ(finite, plain.box_of_points(x.data(), places.data(), count, numbers(own)));
        EXPECT_EQ(finite, expect_box(found, x, places));
        if (finite) {
            EXPECT_EQ(std::memcmp(&found, &own, sizeof found), 0);
        }
        not_finite += !finite;
    }
    EXPECT_GT(not_finite, 100);
}

TEST_P(PointKernels, BoundListsOneAfterTheOther) {
    for (int round = 0; round < 500; ++round) {
        const std::vector<float> x = points(round);
        std::vector<std::vector<std::int32_t>> lists(1 + random() % 5);
        std::vector<std::int32_t> places, counts;
        for (auto& list : lists) {
            list.resize(4 * (random() % 4));
            for (std::int32_t& place : list) place = this->place();
            places.insert(places.end(), list.begin(), list.end());
            counts.push_back(static_cast<std::int32_t>(list.size()));
        }
        std::vector<Box> found(lists.size()), own(lists.size());
        const int count = lists.size();
        const bool finite =
            form->boxes_of_lists(x.data(), places.data(), counts.data(), count, numbers(found[0]));
        EXPECT_EQ(finite,
                  plain.boxes_of_lists(x.data(), places.data(), counts.data(), count, numbers(own[0])));
        bool all_finite = true;
        for (std::size_t l = 0; l < lists.size(); ++l) all_finite &= expect_box(found[l], x, lists[l]);
        EXPECT_EQ(finite, all_finite);
        if (finite) {
            EXPECT_EQ(std::memcmp(found.data(), own.data(), sizeof(Box) * found.size()), 0);
        }
        not_finite += !finite;
    }
    EXPECT_GT(not_finite, 20);
}

TEST_P(PointKernels, BoundSixteenListsSideBySide) {
    for (int round = 0; round < 500; ++round) {
        std::vector<float> x = points(round);
        const bool at_end = round % 4 == 1;
        if (at_end) x.resize(x.size() - 1);  // a sanitizer notices if the number that is gone is read
        x.shrink_to_fit();
        const int count = 1 + round % 20;
        std::vector<std::int32_t> places;
        for (int i = 0; i < 16 * count; ++i) places.push_back(place());
        BoxPack found, own;
        const bool finite = form->boxes_of_points(x.data(), places.data(), count, at_end, found);
        EXPECT_EQ(finite, plain.boxes_of_points(x.data(), places.data(), count, at_end, own));
        bool all_finite = true;
        for (int k = 0; k < 16; ++k) {
            std::vector<std::int32_t> list;
            for (int c = 0; c < count; ++c) list.push_back(places[16 * c + k]);
            all_finite &= expect_box(found.box(k), x, list);
        }
        EXPECT_EQ(finite, all_finite);
        if (finite) {
            EXPECT_EQ(std::memcmp(&found, &own, sizeof found), 0);
        }
        not_finite += !finite;
    }
    EXPECT_GT(not_finite, 50);
}

INSTANTIATE_TEST_SUITE_P(, PointKernels, testing::ValuesIn(instruction_sets),
                         [](const auto& info) { return name(info.param); });

}  // namespace
}  // namespace nbd

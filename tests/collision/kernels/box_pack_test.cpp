#include "collision/kernels/box_pack.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <vector>

#include "collision/geometry/box.hpp"
#include "tests/support/random_triangles.hpp"

namespace nbd {
namespace {

Box random_box(RandomTriangles& random, float side) {
    const Eigen::Vector3f low = random.grid_point(8), size = side * random.grid_point(4);
    return {{low.x(), low.y(), low.z(), 0}, {low.x() + size.x(), low.y() + size.y(), low.z() + size.z(), 0}};
}

TEST(BoxPack, AgreesWithSingleBoxesInEveryLane) {
    RandomTriangles random(1);
    for (int count = 0; count <= BoxPack::lanes; ++count) {
        BoxPack pack;
        std::vector<Box> boxes;
        for (int lane = 0; lane < count; ++lane) {
            boxes.push_back(random_box(random, 0.7f));
            pack.set(lane, boxes.back());
        }
        int touching = 0;
        for (int round = 0; round < 50; ++round) {
            const Box box = random_box(random, 1);
            for (const float distance : {0.f, 0.3f, 2.f}) {
                std::uint16_t close;
                kernels().near(&pack, 1, numbers(box), certain_square(distance), &close);
                for (int lane = 0; lane < BoxPack::lanes; ++lane)
                    EXPECT_EQ(close >> lane & 1, lane < count && !apart(boxes[lane], box, distance));
            }
            // Coordinates are exact here, so boxes that share a face have a point in common.
            std::uint16_t meeting;
            kernels().near(&pack, 1, numbers(box), 0, &meeting);
            for (int lane = 0; lane < BoxPack::lanes; ++lane)
                EXPECT_EQ(meeting >> lane & 1, lane < count && (boxes[lane].lo <= box.hi).all() &&
                                                   (box.lo <= boxes[lane].hi).all());
            touching += std::popcount(meeting);
        }
        EXPECT_TRUE(count == 0 ? touching == 0 : touching > 0) << count;
    }
}

TEST(BoxPack, StoresAndReturnsItsBoxes) {
    RandomTriangles random(2);
    BoxPack pack;
    const Box box = random_box(random, 1);
    pack.set(11, box);
    EXPECT_TRUE((pack.box(11).lo == box.lo).all() && (pack.box(11).hi == box.hi).all());
    pack.grow(0.5f);
    const Eigen::Array4f by(0.5f, 0.5f, 0.5f, 0);
    EXPECT_TRUE((pack.box(11).lo == box.lo - by).all() && (pack.box(11).hi == box.hi + by).all());
}

}  // namespace
}  // namespace nbd

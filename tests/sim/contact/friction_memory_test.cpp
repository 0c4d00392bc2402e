#include "sim/contact/friction_memory.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace nbd {
namespace {

constexpr double slip_length = 1e-3;

SurfacePoint vertex(int body, int v) { return {.body = body, .count = 1, .vertices = {v}, .weights = {1}}; }
SurfacePoint on_edge(int body, int v, int w) {
    return {.body = body, .count = 2, .vertices = {v, w}, .weights = {0.3, 0.7}};
}
SurfacePoint on_face(int body, int u, int v, int w) {
    return {.body = body, .count = 3, .vertices = {u, v, w}, .weights = {0.2, 0.3, 0.5}};
}
Contact contact(const SurfacePoint& a, const SurfacePoint& b) {
    return {.a = a, .b = b, .normal = Eigen::Vector3d::UnitZ(), .friction = 0.5};
}

/// A memory of one contact that slid by `way` and pressed.
FrictionMemory after(Contact first, const Eigen::Vector3d& way, double pressed = 1) {
    FrictionMemory memory;
    memory.recall(first, slip_length);
    memory.remember(std::vector<RubbedContact>{{first, way, pressed}});
    return memory;
}

Eigen::Vector3d stretch_of(const FrictionMemory& memory, Contact later) {
    memory.recall(later, slip_length);
    EXPECT_EQ(later.slip_length, slip_length);
    return later.stretch;
}

const Eigen::Vector3d way(3e-4, 4e-4, 0), none = Eigen::Vector3d::Zero();

TEST(FrictionMemory, KeepsTheSpringOfAVertexFromFaceToFace) {
    const FrictionMemory memory = after(contact(vertex(0, 7), on_face(1, 1, 2, 3)), way);
    EXPECT_EQ(stretch_of(memory, contact(vertex(0, 7), on_face(1, 2, 3, 4))), way);
    EXPECT_EQ(stretch_of(memory, contact(vertex(0, 7), on_edge(1, 4, 2))), way);
    EXPECT_EQ(stretch_of(memory, contact(on_face(1, 2, 3, 4), vertex(0, 7))), -way);
    EXPECT_EQ(stretch_of(memory, contact(vertex(0, 8), on_face(1, 1, 2, 3))), none);
    EXPECT_EQ(stretch_of(memory, contact(vertex(0, 7), on_face(2, 1, 2, 3))), none);
}

TEST(FrictionMemory, KnowsEdgesByTheirEndsInAnyOrder) {
    const FrictionMemory memory = after(contact(on_edge(0, 5, 6), on_edge(1, 2, 9)), way);
    EXPECT_EQ(stretch_of(memory, contact(on_edge(0, 6, 5), on_edge(1, 9, 2))), way);
    EXPECT_EQ(stretch_of(memory, contact(on_edge(1, 9, 2), on_edge(0, 5, 6))), -way);
    EXPECT_EQ(stretch_of(memory, contact(on_edge(0, 5, 6), on_edge(1, 2, 8))), none);
}

TEST(FrictionMemory, TellsObstaclesApart) {
    Contact floor = contact(vertex(0, 7), {}), wall = floor;
    floor.obstacle = 0;
    wall.obstacle = 1;
    const FrictionMemory memory = after(floor, way);
    EXPECT_EQ(stretch_of(memory, floor), way);
    EXPECT_EQ(stretch_of(memory, wall), none);
}

TEST(FrictionMemory, StretchesByTheSlipLengthAtMost) {
    const Contact first = contact(vertex(0, 7), on_face(1, 1, 2, 3));
    EXPECT_TRUE(stretch_of(after(first, 10 * way), first).isApprox(2 * way));
    FrictionMemory memory = after(first, way);
    for (int step = 0; step < 3; ++step) {
        Contact next = first;
        memory.recall(next, slip_length);
        memory.remember(std::vector<RubbedContact>{{next, 0.4 * way, 1}});
    }
    EXPECT_TRUE(stretch_of(memory, first).isApprox(2 * way));
}

TEST(FrictionMemory, TurnsWithTheSurface) {
    const Contact first = contact(vertex(0, 7), on_face(1, 1, 2, 3));
    Contact later = first;
    later.normal = Eigen::Vector3d(0.6, 0, 0.8);
    const Eigen::Vector3d stretch = stretch_of(after(first, way), later);
    EXPECT_NEAR(stretch.dot(later.normal), 0, 1e-18);
    EXPECT_EQ(stretch.y(), way.y());
}

TEST(FrictionMemory, ForgetsWhatDoesNotPress) {
    const Contact first = contact(vertex(0, 7), on_face(1, 1, 2, 3));
    EXPECT_EQ(stretch_of(after(first, way, 0), first), none);
    FrictionMemory memory = after(first, way);
    memory.remember({});
    EXPECT_EQ(stretch_of(memory, first), none);
}

TEST(FrictionMemory, CountsTheHardestOfTheContactsOfOneVertex) {
    const Contact soft = contact(vertex(0, 7), on_face(1, 1, 2, 3)),
                  hard = contact(vertex(0, 7), vertex(1, 4));
    FrictionMemory memory;
    Contact known = soft;
    memory.recall(known, slip_length);
    Contact harder = hard;
    memory.recall(harder, slip_length);
    for (const bool hard_first : {false, true}) {
        std::vector<RubbedContact> rubbed{{known, none, 1}, {harder, way, 2}};
        if (hard_first)
            memory.remember(std::vector<RubbedContact>{rubbed[1], rubbed[0]});
        else
            memory.remember(rubbed);
        EXPECT_EQ(stretch_of(memory, soft), way);
    }
}

TEST(FrictionMemory, IsRestoredFromItsStretches) {
    const Contact first = contact(on_edge(0, 5, 6), on_edge(1, 2, 9));
    const FrictionStretches stretches = after(first, way).stretches();
    ASSERT_EQ(stretches.contacts.size(), 1u);
    FrictionMemory memory;
    memory.restore(stretches);
    EXPECT_EQ(stretch_of(memory, first), way);
}

}  // namespace
}  // namespace nbd

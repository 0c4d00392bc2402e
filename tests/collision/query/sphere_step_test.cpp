// NBD-Trees over a step: the spheres of both ends bound what moves straight between them.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "tests/collision/models.hpp"
#include "tests/support/brute_force.hpp"

namespace nbd {
namespace {

constexpr BoundKind of_spheres[] = {BoundKind::exact, BoundKind::bd, BoundKind::nbd};

/// A surface of any size and its modes; bounds by modes hold for its poses.
struct ModalBody {
    float size;
    shapes::Surface s;
    shapes::Modes modes;
    std::shared_ptr<const CollisionTree> tree;

    ModalBody(const shapes::Surface& unit, float times, const SphereTreeConfig& config)
        : size(times), s{unit.X * times, unit.F}, modes(shapes::make_modes(unit, 6, 60, 1)) {
        modes.clustered.X *= size;
        CollisionTree made = shapes::full_tree(s, modes, config);
        NbdModel& nbd = *made.nbd;
        for (Eigen::MatrixXf* lengths : {&nbd.out_centre, &nbd.out_scale}) *lengths *= size;
        nbd.z_centre *= size;
        nbd.z_scale /= size;
        tree = std::make_shared<const CollisionTree>(std::move(made));
    }

    /// Deformed by a share of its size, then moved; translations in sizes.
    Vertices pose(std::mt19937& random, float deformed, RigidTransform motion) const {
        const Eigen::VectorXf q = Eigen::VectorXf::NullaryExpr(
            modes.U.cols(), [&](Eigen::Index) { return deformed * size * shapes::uniform(random); });
        motion.t *= size;
        return shapes::moved(shapes::nbd_pose(s, modes.U, q), motion);
    }
    PosedTree posed(BoundKind kind) const {
        return {tree, kind, kind == BoundKind::nbd ? std::optional(30.f) : std::nullopt};
    }
};

struct StraightStep {
    Vertices start, end;
    Vertices at(float time) const { return start + time * (end - start); }
    void begin(PosedTree& tree) const { tree.begin_step(start, end); }
};

enum class Travel { small, large, flight_past, half_turn };

/// Near `centre` at some time of the step, in sizes.
StraightStep straight_step(const ModalBody& body, Travel motion, const Eigen::Vector3f& centre,
                           std::mt19937& random) {
    RigidTransform begin = shapes::random_motion(random, 0.4f), end = begin;
    float deformed = 0.05f;
    if (motion == Travel::small) {
        end.t += 0.05f * shapes::uniform3(random);
        deformed = 0.01f;
    } else if (motion == Travel::large) {
        end = shapes::random_motion(random, 0.4f);
    } else if (motion == Travel::flight_past) {
        const Eigen::Vector3f way = 20 * shapes::uniform3(random).normalized();
        begin.t -= way;
        end.t += way;
    } else {
        const Eigen::AngleAxisf turn(std::numbers::pi_v<float>, shapes::uniform3(random).normalized());
        end.R = turn.toRotationMatrix() * begin.R;
    }
    begin.t += centre;
    end.t += centre;
    const Vertices start = body.pose(random, deformed, begin);
    return {start, body.pose(random, deformed, end)};
}

TEST(SphereStep, LeavesOutNoFacesThatAreNearAtAnyTimeOfAnyMotion) {
    std::mt19937 random(1);
    PairQuery query;
    std::size_t near = 0, missed_at_ends = 0, found_by_spheres = 0, found_by_boxes = 0,
                found_with_margins = 0, found_without = 0;
    for (const float size : {1e-3f, 1.f, 100.f}) {
        const ModalBody s(shapes::torus(18, 10), size, {.depth = 5, .min_leaf_faces = 2}),
            t(shapes::sphere(8, 10, 0.3f), size, {.depth = 4, .min_leaf_faces = 2});
        const float distance = 0.02f * size;
        for (const float shift : {0.f, 30.f})
            for (const Travel motion :
                 {Travel::small, Travel::large, Travel::flight_past, Travel::half_turn}) {
                SCOPED_TRACE("size " + std::to_string(size) + ", shift " + std::to_string(shift) +
                             ", motion " + std::to_string(static_cast<int>(motion)));
                const Eigen::Vector3f centre = shift * Eigen::Vector3f(1, -1, 1);
                const StraightStep a = straight_step(s, motion, centre, random),
                                   b = straight_step(t,
                                                     motion == Travel::flight_past ? Travel::small : motion,
                                                     centre, random);
                std::vector<FacePair> at_any_time, at_ends;
                for (int i = 0; i <= 8; ++i) {
                    // Positions in between are rounded: a bit less than the distance stays within it.
                    const float time = 0.125f * static_cast<float>(i);
                    const auto now = test::brute_force_within(a.at(time), s.s.F, b.at(time), t.s.F,
                                                              i % 8 == 0 ? distance : 0.99f * distance);
                    at_any_time.insert(at_any_time.end(), now.begin(), now.end());
                    if (i % 8 == 0) at_ends.insert(at_ends.end(), now.begin(), now.end());
                }
                at_any_time = test::sorted(at_any_time);
                at_any_time.erase(std::unique(at_any_time.begin(), at_any_time.end()), at_any_time.end());
                near += at_any_time.size();
                for (const FacePair& pair : at_any_time)
                    missed_at_ends += std::ranges::count(at_ends, pair) == 0;

                PosedTree boxes_a = s.posed(BoundKind::boxes), boxes_b = t.posed(BoundKind::boxes);
                a.begin(boxes_a);
                b.begin(boxes_b);
                const auto by_boxes = test::sorted(query.boxes_within(boxes_a, boxes_b, distance));
                found_by_boxes += by_boxes.size();
                for (const BoundKind kind : of_spheres) {
                    PosedTree tree_a = s.posed(kind), tree_b = t.posed(kind);
                    a.begin(tree_a);
                    b.begin(tree_b);
                    const auto found = test::sorted(query.boxes_within(tree_a, tree_b, distance));
                    EXPECT_TRUE(std::ranges::includes(found, at_any_time)) << name(kind);
                    EXPECT_TRUE(std::ranges::includes(by_boxes, found)) << name(kind);
                    if (kind == BoundKind::exact) found_by_spheres += found.size();
                    if (kind != BoundKind::nbd) continue;
                    PosedTree narrow_a(s.tree, kind), narrow_b(t.tree, kind);  // without margins
                    a.begin(narrow_a);
                    b.begin(narrow_b);
                    const auto subset = test::sorted(query.boxes_within(narrow_a, narrow_b, distance));
                    EXPECT_TRUE(std::ranges::includes(found, subset));
                    found_with_margins += found.size();
                    found_without += subset.size();
                }
            }
    }
    EXPECT_GT(near, 5000u);
    EXPECT_GT(missed_at_ends, near / 4) << "many are near in between alone";
    EXPECT_LT(found_by_spheres, found_by_boxes) << "spheres leave out some whose boxes are near";
    EXPECT_LT(found_without, found_with_margins) << "untrained networks miss";
    EXPECT_GT(found_without, 0u);
}

TEST(SphereStep, FindsAllNearBoxesUnderOneSphere) {
    std::mt19937 random(2);
    const ModalBody s(shapes::torus(24, 12), 1, {.depth = 0}),
        t(shapes::sphere(12, 16, 0.3f), 1, {.depth = 0});
    PairQuery query;
    std::size_t found = 0;
    for (const Travel motion : {Travel::small, Travel::large, Travel::half_turn}) {
        const StraightStep a = straight_step(s, motion, {0, 0, 0}, random),
                           b = straight_step(t, motion, {0, 0, 0}, random);
        PosedTree boxes_a = s.posed(BoundKind::boxes), boxes_b = t.posed(BoundKind::boxes),
                  spheres_a = s.posed(BoundKind::exact), spheres_b = t.posed(BoundKind::exact);
        for (PosedTree* tree : {&boxes_a, &spheres_a}) a.begin(*tree);
        for (PosedTree* tree : {&boxes_b, &spheres_b}) b.begin(*tree);
        const auto expected = test::sorted(query.boxes_within(boxes_a, boxes_b, 0.01f));
        EXPECT_EQ(test::sorted(query.boxes_within(spheres_a, spheres_b, 0.01f)), expected);
        found += expected.size();
        // A body in a pose does not move.
        spheres_b.begin_pose(b.start);
        boxes_b.begin_pose(b.start);
        EXPECT_EQ(test::sorted(query.boxes_within(spheres_a, spheres_b, 0.01f)),
                  test::sorted(query.boxes_within(boxes_a, boxes_b, 0.01f)));
    }
    EXPECT_GT(found, 3000u);
}

TEST(SphereStep, LooksAtFewNodesOfBodiesThatStayApart) {
    const ModalBody s(shapes::torus(60, 40), 1, {.depth = 7, .min_leaf_faces = 2});
    const long nodes = 2 * std::ssize(s.tree->spheres.nodes);
    ASSERT_GT(nodes, 400);
    PairQuery query;
    for (const BoundKind kind : of_spheres) {
        PosedTree a(s.tree, kind), b(s.tree, kind);
        // Rings that stand side by side, and move along each other.
        const StraightStep here{s.s.X, s.s.X.rowwise() + Eigen::RowVector3f(0, 0.2f, 0)};
        const auto moved_to = [&](float x) {
            const Eigen::RowVector3f by(x, 0, 0);
            return StraightStep{here.start.rowwise() + by, here.end.rowwise() + by};
        };
        const StraightStep far = moved_to(9), beside = moved_to(1.6f);
        here.begin(a);
        far.begin(b);
        EXPECT_TRUE(query.boxes_within(a, b, 0.01f).empty());
        EXPECT_EQ(query.counters().node_tests, 1) << name(kind);
        EXPECT_EQ(query.counters().nodes_bounded, 4) << name(kind) << ": two roots at both ends";
        EXPECT_EQ(a.nodes_bounded() + b.nodes_bounded(), 4) << name(kind);
        here.begin(a);
        beside.begin(b);
        EXPECT_TRUE(query.boxes_within(a, b, 0.01f).empty()) << name(kind);
        EXPECT_GT(query.counters().nodes_bounded, 4) << name(kind);
        EXPECT_LT(query.counters().nodes_bounded, nodes / 2)
            << name(kind) << ", of twice as many at both ends";
        EXPECT_EQ(query.counters().triangle_tests, 0) << name(kind);
    }
}

TEST(SphereStep, BoundsEachEndExactlyWhereItsInputIsOutOfRange) {
    std::mt19937 random(4);
    const ModalBody s(shapes::torus(18, 10), 1, {.depth = 4});
    CollisionTree strict = *s.tree;
    const int modes = strict.nbd->mode_count();
    strict.nbd->z_mean = Eigen::VectorXf::Zero(modes);  // no pose is this one
    strict.nbd->z_whitening = Eigen::MatrixXf::Identity(modes, modes);
    strict.calibrations[BoundKind::nbd].limits.assign(strict.spheres.nodes.size(), 0.f);
    const auto shared = std::make_shared<const CollisionTree>(std::move(strict));
    const StraightStep a = straight_step(s, Travel::large, {0, 0, 0}, random),
                       b = straight_step(s, Travel::large, {0.5f, 0, 0}, random);
    PosedTree gated_a(shared, BoundKind::nbd), gated_b(shared, BoundKind::nbd),
        exact_a = s.posed(BoundKind::exact), exact_b = s.posed(BoundKind::exact);
    for (PosedTree* tree : {&gated_a, &exact_a}) a.begin(*tree);
    for (PosedTree* tree : {&gated_b, &exact_b}) b.begin(*tree);
    PairQuery query;
    const auto expected = test::sorted(query.boxes_within(exact_a, exact_b, 0.01f));
    EXPECT_GT(expected.size(), 1000u);
    EXPECT_EQ(query.counters().nodes_out_of_range, 0);
    EXPECT_EQ(test::sorted(query.boxes_within(gated_a, gated_b, 0.01f)), expected);
    EXPECT_EQ(query.counters().nodes_out_of_range, query.counters().nodes_bounded);
    EXPECT_GT(query.counters().nodes_bounded, 40);
}

}  // namespace
}  // namespace nbd

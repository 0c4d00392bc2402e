#include "collision/query/self_query.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "collision/geometry/box.hpp"
#include "collision/geometry/closest_points.hpp"
#include "collision/geometry/triangle_triangle.hpp"
#include "tests/collision/models.hpp"
#include "tests/collision/wide_tree/hung_surface.hpp"
#include "tests/support/brute_force.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using shapes::Surface;
using test::HungSurface;

bool share_a_vertex(const Faces& F, const FacePair& pair) {
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (F(pair.a, i) == F(pair.b, j)) return true;
    return false;
}

/// Pairs (a, b), a < b, of faces without a common vertex whose boxes come within `distance` and for whose
/// triangles take() holds: every face against every other.
template <class Take>
std::vector<FacePair> pairs_of_one_body(const Vertices& x, const Faces& F, float distance, const Take& take) {
    std::vector<Box> boxes;
    for (int f = 0; f < F.rows(); ++f) boxes.push_back(bounding_box(test::face_triangle(x, F, f)));
    std::vector<FacePair> pairs;
    for (int a = 0; a < F.rows(); ++a)
        for (int b = a + 1; b < F.rows(); ++b)
            if (!apart(boxes[a], boxes[b], distance) && !share_a_vertex(F, {a, b}) &&
                take(test::face_triangle(x, F, a), test::face_triangle(x, F, b)))
                pairs.push_back({a, b});
    return pairs;
}
std::vector<FacePair> intersecting(const Vertices& x, const Faces& F) {
    return pairs_of_one_body(x, F, 0, triangles_intersect);
}
std::vector<FacePair> within(const Vertices& x, const Faces& F, float distance) {
    return pairs_of_one_body(x, F, distance, [&](const Triangle& s, const Triangle& t) {
        return triangle_distance(s, t) <= double{distance};
    });
}
std::vector<FacePair> boxes_within(const Vertices& x, const Faces& F, float distance) {
    return pairs_of_one_body(x, F, distance, [](const Triangle&, const Triangle&) { return true; });
}

/// Text of the pairs that only one of two lists has.
std::string difference(const std::vector<FacePair>& found, const std::vector<FacePair>& expected) {
    std::ostringstream text;
    const auto list = [&](const char* what, const auto& s, const auto& t) {
        std::vector<FacePair> only;
        std::ranges::set_difference(s, t, std::back_inserter(only));
        if (!only.empty()) text << only.size() << what;
        for (std::size_t i = 0; i < std::min<std::size_t>(only.size(), 5); ++i)
            text << " (" << only[i].a << ", " << only[i].b << ")";
    };
    list(" missing:", expected, found);
    list(" too many:", found, expected);
    return text.str();
}

float size_of(const Vertices& x) { return (x.colwise().maxCoeff() - x.colwise().minCoeff()).norm(); }

/// A body with every kind of bounds that never misses, each in the pose of the same nodes.
class ExactBodies {
 public:
    explicit ExactBodies(const HungSurface& hung, const SphereTreeConfig& config = {}) : hung_(hung) {
        const auto shared = test::hung_tree(hung, config);
        for (const BoundKind kind :
             {BoundKind::affine, BoundKind::boxes, BoundKind::exact, BoundKind::automatic})
            bodies_.emplace_back(shared, kind);
    }

    /// Expects the queries of all bodies to find what brute force finds. Returns the number of intersecting
    /// pairs.
    std::size_t check(const Vertices& nodes, float distance) {
        const Vertices x = embedded(hung_.W, nodes);
        const Faces& F = hung_.surface.F;
        const auto touching = intersecting(x, F), near = within(x, F, distance),
                   near_boxes = boxes_within(x, F, distance);
        for (PosedTree& body : bodies_) {
            if (body.kind() == BoundKind::affine)
                body.begin_pose_of_nodes(nodes);
            else
                body.begin_pose(x);
            EXPECT_EQ(difference(test::listed(query_.intersecting(body)), touching), "") << name(body.kind());
            EXPECT_EQ(query_.counters().face_pairs, static_cast<long>(touching.size()));
            EXPECT_EQ(difference(test::listed(query_.within(body, distance)), near), "") << name(body.kind());
            auto boxes = test::listed(query_.boxes_within(body, distance));
            std::ranges::sort(boxes);
            EXPECT_EQ(difference(boxes, near_boxes), "") << name(body.kind());
            EXPECT_TRUE(std::ranges::includes(boxes, near)) << name(body.kind());
        }
        return touching.size();
    }

 private:
    const HungSurface& hung_;
    std::vector<PosedTree> bodies_;
    SelfQuery query_;
};

TEST(SelfQuery, AgreesWithBruteForceInWildPoses) {
    std::mt19937 random(1);
    std::size_t found = 0;
    for (const HungSurface& hung :
         {test::hung_on_tets(shapes::torus(24, 12), 3), test::hung_on_lattice(shapes::sphere(14, 20), 2),
          test::hung_on_itself(shapes::bar(20, 14)), test::hung_on_itself(shapes::sphere(3, 4))}) {
        ExactBodies bodies(hung, {.depth = 4});
        for (int kind = 0; kind < 2 * test::wild_poses; ++kind) {
            SCOPED_TRACE(kind);
            const Vertices nodes = test::wild_pose(hung.rest, kind, random);
            found += bodies.check(nodes, 0.01f * size_of(nodes));
        }
    }
    EXPECT_GT(found, 10000u);
}

TEST(SelfQuery, AgreesWithBruteForceOnMoreThanOneCluster) {
    std::mt19937 random(2);
    const HungSurface hung = test::hung_on_tets(shapes::torus(60, 36), 4);
    ASSERT_GT(hung.surface.F.rows(), WideTree::cluster_faces);
    ExactBodies bodies(hung);
    EXPECT_EQ(bodies.check(hung.rest, 0), 0u) << "at rest nothing crosses";
    EXPECT_GT(bodies.check(test::wild_pose(hung.rest, 3, random), 0.002f), 2048u) << "more than a batch";
}

TEST(SelfQuery, AgreesWithBruteForceOnSoups) {
    // Few vertices, so that many faces share one, on a grid, so that many touch, are coplanar or degenerate.
    std::mt19937 random(3);
    const auto integer = [&](int below) { return random() % static_cast<unsigned>(below); };
    std::size_t found = 0;
    for (int soup = 0; soup < 12; ++soup) {
        const int vertices = 6 + 30 * soup, grid = 3 + soup;
        Surface s{Vertices(vertices, 3), Faces(10 + 40 * soup, 3)};
        for (float& x : s.X.reshaped()) x = static_cast<float>(integer(grid));
        for (int& v : s.F.reshaped()) v = integer(vertices);
        const HungSurface hung = test::hung_on_itself(s);
        ExactBodies bodies(hung, {.depth = 3, .min_leaf_faces = 1});
        found += bodies.check(s.X, soup % 2 == 0 ? 1.f : 0.f);
    }
    EXPECT_GT(found, 1000u);
}

TEST(SelfQuery, FindsWhereAFoldedSheetTouchesItself) {
    constexpr int rows = 30, columns = 20;
    Surface sheet{Vertices((rows + 1) * (columns + 1), 3), Faces(2 * rows * columns, 3)};
    Vertices folded = sheet.X;
    for (int i = 0; i <= rows; ++i)
        for (int j = 0; j <= columns; ++j) {
            const float u = static_cast<float>(i) / rows, v = static_cast<float>(j) / columns;
            sheet.X.row(i * (columns + 1) + j) << u, v, 0;
            // The flaps cross: a line of faces of one meets a line of faces of the other.
            folded.row(i * (columns + 1) + j) << std::abs(u - 0.5f), v,
                (u < 0.5f ? 0.4f : -0.3f) * (v - 0.5f);
        }
    for (int i = 0, f = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) {
            const int a = i * (columns + 1) + j, b = a + columns + 1;
            sheet.F.row(f++) << a, b, b + 1;
            sheet.F.row(f++) << a, b + 1, a + 1;
        }
    const HungSurface hung = test::hung_on_itself(sheet);
    ExactBodies bodies(hung);
    EXPECT_EQ(bodies.check(sheet.X, 0.01f), 0u);
    const std::size_t found = bodies.check(folded, 0.01f);
    EXPECT_GT(found, 20u);
    EXPECT_LT(found, 1000u);

    // What was near at rest is near in the fold's pose, too, but no contact.
    const auto at_rest = near_at_rest(sheet.X, sheet.F, 0.07f);
    PosedTree body(shared_exact_tree(sheet.X, sheet.F), BoundKind::boxes);
    SelfQuery all, contacts(at_rest);
    body.begin_pose(sheet.X);
    EXPECT_EQ(all.within(body, 0.07f).size(), at_rest->size());
    EXPECT_GT(at_rest->size(), 5000u);
    EXPECT_TRUE(contacts.within(body, 0.07f).empty());
    body.begin_pose(folded);
    auto expected = within(folded, sheet.F, 0.06f);
    const std::size_t before = expected.size();
    std::erase_if(expected, [&](const FacePair& pair) { return at_rest->contains(pair.b, pair.a); });
    EXPECT_LT(expected.size(), before / 2);
    EXPECT_GT(expected.size(), 100u);
    EXPECT_EQ(test::listed(contacts.within(body, 0.06f)), expected);
    PosedTree spheres(shared_exact_tree(sheet.X, sheet.F), BoundKind::exact);
    spheres.begin_pose(folded);
    EXPECT_EQ(test::listed(contacts.within(spheres, 0.06f)), expected);
}

TEST(SelfQuery, FindsASubsetWithLearnedBounds) {
    std::mt19937 random(4);
    const Surface s = shapes::torus(40, 24);
    const auto tree = shapes::shared_full_tree(s, 20, 200, 1);
    SelfQuery query;
    for (const BoundKind kind : shapes::kinds_of(*tree)) {
        PosedTree body(tree, kind);
        std::size_t found = 0;
        for (int pose = 0; pose < 6; ++pose) {
            const Vertices x = test::wild_pose(s.X, 3 * (pose % 2), random);
            body.begin_pose(x);
            const auto expected = intersecting(x, s.F), pairs = test::listed(query.intersecting(body));
            EXPECT_TRUE(std::ranges::includes(expected, pairs)) << name(kind);
            if (!can_miss(kind)) {
                EXPECT_EQ(pairs, expected) << name(kind);
            }
            found += pairs.size();
        }
        EXPECT_GT(found, 1000u) << name(kind);
    }
}

TEST(SelfQuery, RefusesDistancesAndPairsThatItCannotUse) {
    const Surface s = shapes::torus(12, 8), other = shapes::torus(24, 8);
    PosedTree body(shared_exact_tree(other.X, other.F), BoundKind::boxes);
    body.begin_pose(other.X);
    SelfQuery all;
    EXPECT_EQ(test::refusal([&] { all.within(body, -1); }), "distance is -1 m, allowed: finite, 0 or more");
    SelfQuery query(near_at_rest(s.X, s.F, 0.1f));
    EXPECT_EQ(test::refusal([&] { query.intersecting(body); }),
              "the query leaves out pairs of a surface of 192 faces, but the body has 384");
    EXPECT_FALSE(SelfQuery(near_at_rest(other.X, other.F, 0.1f)).within(body, 0.5f).empty());
}

TEST(SelfQuery, ComparesEveryPairOfPartsOnce) {
    const Surface s = shapes::torus(120, 90);
    PosedTree body(shared_exact_tree(s.X, s.F), BoundKind::boxes);
    body.begin_pose(s.X);
    SelfQuery one;
    PairQuery two;
    one.boxes_within(body, 0);
    two.boxes_within(body, body, 0);
    // Both take the leaves beside themselves.
    EXPECT_LE(2 * one.counters().leaf_pairs, two.counters().leaf_pairs + s.F.rows() / 8);
    EXPECT_LT(2 * one.counters().triangle_tests, two.counters().triangle_tests - 12 * s.F.rows());
}

TEST(FacePairSet, HoldsPairsInEitherOrder) {
    const std::vector<FacePair> pairs = {{3, 1}, {0, 4}, {1, 3}, {1, 2}};
    const FacePairSet set(pairs, 5);
    EXPECT_EQ(set.size(), 3u);
    EXPECT_EQ(set.face_count(), 5);
    for (int a = 0; a < 5; ++a)
        for (int b = 0; b < 5; ++b)
            EXPECT_EQ(set.contains(a, b), std::ranges::count(pairs, FacePair{a, b}) > 0 ||
                                              std::ranges::count(pairs, FacePair{b, a}) > 0);
    EXPECT_EQ(test::error_of([] {
                  FacePairSet(std::vector<FacePair>{{0, 1}, {1, 5}}, 5);
              }),
              "the pair (1, 5) is of faces that are not there; allowed: 0 to 4");
    std::vector<FacePair> odd;  // more than a list that is read at once
    for (int b = 1; b < 400; b += 2) odd.push_back({0, b});
    const FacePairSet many(odd, 400);
    for (int b = 1; b < 400; ++b) EXPECT_EQ(many.contains(0, b), b % 2 == 1) << b;
    const Surface s = shapes::torus(12, 8);
    EXPECT_EQ(test::error_of([&] { near_at_rest(s.X, s.F, -1); }),
              "distance is -1 m, allowed: finite, 0 or more");
}

}  // namespace
}  // namespace nbd

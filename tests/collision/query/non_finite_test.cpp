// Poses of other sizes than the body, and with numbers that are not finite.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "collision/query/closest_query.hpp"
#include "collision/query/many_body_query.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"
#include "tests/collision/models.hpp"
#include "tests/collision/wide_tree/hung_surface.hpp"
#include "tests/support/brute_force.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

struct NonFinite : testing::Test {
    test::HungSurface hung = test::hung_on_tets(shapes::torus(24, 14), 3);
    shapes::Surface& s = hung.surface;
    std::shared_ptr<const CollisionTree> tree = make_tree();
    Vertices other = s.X.rowwise() + Eigen::RowVector3f(0.5f, 0.4f, 0.3f);

    std::shared_ptr<const CollisionTree> make_tree() const {
        CollisionTree made = shapes::full_tree(s, shapes::make_modes(s, 12, 90, 3), {.depth = 4});
        hang_on_nodes(made, hung.W, hung.rest);
        return std::make_shared<const CollisionTree>(std::move(made));
    }
    /// Bounds that can miss get a margin with which they do not.
    PosedTree posed(BoundKind kind) const {
        return {tree, kind,
                can_miss(kind) || kind == BoundKind::automatic ? std::optional(2.f) : std::nullopt};
    }
    std::vector<FacePair> contact = test::brute_force_intersecting(s.X, s.F, other, s.F);

    /// Answers about bodies in contact, without those of faces that use `vertex`.
    std::vector<FacePair> expected(int vertex) const {
        std::vector<FacePair> pairs = contact;
        std::erase_if(pairs, [&](const FacePair& pair) { return (s.F.row(pair.a).array() == vertex).any(); });
        return pairs;
    }
    /// A vertex of a face in contact, and one far from every contact.
    int touching_vertex() const { return s.F(contact.front().a, 1); }
    int far_vertex() const {
        int vertex = 0;
        (s.X * Eigen::Vector3f(0.5f, 0.4f, 0.3f)).minCoeff(&vertex);
        return vertex;
    }
};

TEST_F(NonFinite, BodiesWithoutAPoseTouchNothing) {
    constexpr float far = 2e19f;  // infinite when squared
    const std::size_t faces = s.F.rows();
    for (const BoundKind kind : shapes::kinds_of(*tree)) {
        SCOPED_TRACE(name(kind));
        PosedTree a = posed(kind), b = posed(kind);
        PosedTree* const bodies[] = {&a, &b};
        PairQuery query;
        SelfQuery self;
        const auto expect_nothing = [&] {
            EXPECT_TRUE(query.intersecting(a, b).empty());
            EXPECT_TRUE(query.intersecting(b, a).empty());
            EXPECT_TRUE(query.within(a, b, far).empty());
            EXPECT_TRUE(query.boxes_within(a, b, far).empty());
            EXPECT_TRUE(self.boxes_within(b, far).empty());
            EXPECT_FALSE(ClosestQuery().closest(a, b));
            EXPECT_TRUE(ManyBodyQuery().within(bodies, 10).empty());
            EXPECT_TRUE((b.whole().lo > b.whole().hi).any());
        };
        expect_nothing();
        a.begin_pose(s.X);
        EXPECT_FALSE((a.whole().lo > a.whole().hi).any());
        expect_nothing();
        b.begin_pose(other);
        EXPECT_EQ(query.within(a, b, far).size(), faces * faces);
        EXPECT_EQ(ManyBodyQuery().within(bodies, 10).size(), 1u);
        EXPECT_EQ(self.boxes_within(b, far).size(), (faces * (faces - 1) - 12 * faces) / 2)
            << "all but the twelve around each face";
    }
    EXPECT_TRUE(ManyBodyQuery().intersecting({}).empty());
}

constexpr bool reads_all_at_once(BoundKind kind) {
    return is_exact(kind) || kind == BoundKind::affine;  // without nodes, `affine` is like `boxes`
}

TEST_F(NonFinite, PositionsAreRefusedWhereTheyAreRead) {
    for (const BoundKind kind : shapes::kinds_of(*tree)) {
        PosedTree a = posed(kind), b = posed(kind);
        b.begin_pose(other);
        for (const float bad : {NAN, INFINITY, -INFINITY})
            for (const int vertex : {touching_vertex(), far_vertex()}) {
                Vertices x = s.X;
                x(vertex, 1) = bad;
                const std::string expected_error = "position of vertex " + std::to_string(vertex) + " is (";
                PairQuery query;
                SelfQuery self;
                ClosestQuery closest;
                const std::string at_once = test::refusal([&] { a.begin_pose(x); });
                if (reads_all_at_once(kind)) {
                    EXPECT_TRUE(at_once.starts_with(expected_error)) << name(kind) << ": " << at_once;
                    EXPECT_TRUE(at_once.ends_with("), allowed: finite numbers")) << at_once;
                    // The body has no pose: it touches nothing, and is not near everything.
                    EXPECT_TRUE(query.within(a, b, 10).empty()) << name(kind);
                    EXPECT_TRUE(query.intersecting(b, a).empty()) << name(kind);
                    EXPECT_TRUE(self.intersecting(a).empty()) << name(kind);
                    EXPECT_FALSE(closest.closest(a, b)) << name(kind);
                } else if (at_once.empty()) {
                    // Either the query reads the vertex and says so, or the vertex has no part in the answer.
                    std::vector<FacePair> pairs;
                    const std::string in_query =
                        test::refusal([&] { pairs = test::listed(query.intersecting(a, b)); });
                    if (vertex == touching_vertex())
                        EXPECT_TRUE(in_query.starts_with(expected_error)) << name(kind) << ": " << in_query;
                    else if (in_query.empty())
                        EXPECT_EQ(pairs, expected(vertex)) << name(kind);
                    else
                        EXPECT_TRUE(in_query.starts_with(expected_error)) << name(kind) << ": " << in_query;
                    // Queries that look at all of the body find it.
                    EXPECT_TRUE(test::refusal([&] { query.within(a, b, 10); }).starts_with(expected_error))
                        << name(kind);
                    EXPECT_TRUE(test::refusal([&] { self.within(a, 10); }).starts_with(expected_error))
                        << name(kind);
                } else {
                    EXPECT_TRUE(at_once.starts_with(expected_error)) << name(kind) << ": " << at_once;
                }
                a.begin_pose(s.X);
                EXPECT_EQ(test::listed(query.intersecting(a, b)), contact) << name(kind);
            }
    }
}

TEST_F(NonFinite, WhatOnlyOneTreeOfABodyReadHasNoPartInAnswersOfTheOther) {
    for (const BoundKind kind : {BoundKind::bd, BoundKind::nbd}) {
        PosedTree a = posed(kind), spheres = posed(BoundKind::exact), boxes = posed(BoundKind::boxes);
        const std::vector<int>& representatives = tree->bd->modes.representatives;
        int vertex = 0;
        while (std::ranges::find(representatives, vertex) != representatives.end()) ++vertex;
        Vertices x = s.X;
        x(vertex, 1) = NAN;
        const Vertices far = other.rowwise() + Eigen::RowVector3f(50, 0, 0);
        a.begin_pose(x);
        boxes.begin_pose(other);
        spheres.begin_pose(far);
        PairQuery query;
        EXPECT_NE(test::refusal([&] { query.intersecting(a, boxes); }), "") << name(kind);
        EXPECT_EQ(test::refusal([&] { a.whole(); }), "") << name(kind);
        EXPECT_TRUE(query.intersecting(a, spheres).empty()) << name(kind);
    }
}

TEST_F(NonFinite, NodesAreRefused) {
    const Vertices other_nodes = hung.rest.rowwise() + Eigen::RowVector3f(0.5f, 0.4f, 0.3f);
    for (const BoundKind kind : {BoundKind::affine, BoundKind::automatic}) {
        PosedTree a = posed(kind), b = posed(kind);
        b.begin_pose_of_nodes(other_nodes);
        PairQuery query;
        for (int node = 0; node < hung.rest.rows(); node += 7) {
            Vertices nodes = hung.rest;
            nodes(node, 2) = NAN;
            const bool carries = Eigen::MatrixXf(hung.W).col(node).maxCoeff() > 0;
            const std::string error = test::refusal([&] { a.begin_pose_of_nodes(nodes); });
            EXPECT_EQ(error.starts_with("position of node " + std::to_string(node) + " is ("), carries)
                << error;
            if (carries) {
                EXPECT_TRUE(query.within(a, b, 10).empty());
            }
        }
        a.begin_pose_of_nodes(hung.rest);
        EXPECT_FALSE(query.intersecting(a, b).empty());
    }
}

TEST_F(NonFinite, BothEndsOfAStepAreChecked) {
    // Vertices that representatives are and are not; both are read where all is near.
    const std::vector<int>& read = tree->bd->modes.representatives;
    int unread = 0;
    while (std::ranges::find(read, unread) != read.end()) ++unread;
    for (const BoundKind kind : shapes::kinds_of(*tree))
        for (const bool at_start : {true, false})
            for (const int vertex : {read[3], unread}) {
                SCOPED_TRACE(std::string(name(kind)) + (at_start ? ", start" : ", end"));
                const std::string expected_error =
                    "position of vertex " + std::to_string(vertex) + " is (inf, ";
                PosedTree a = posed(kind), b = posed(kind);
                PairQuery query;
                b.begin_step(other, s.X);
                Vertices start = s.X, end = other;
                (at_start ? start : end)(vertex, 0) = INFINITY;
                std::string error = test::refusal([&] { a.begin_step(start, end); });
                if (is_box(kind) || kind == BoundKind::exact) {
                    EXPECT_TRUE(error.starts_with(expected_error)) << error;
                    EXPECT_TRUE(query.boxes_within(a, b, 10).empty()) << "it has no pose";
                } else {
                    EXPECT_EQ(error, "");
                    error = test::refusal([&] { a.whole(); });
                    EXPECT_EQ(error.starts_with(expected_error), vertex == read[3]) << error;
                    error = test::refusal([&] { query.boxes_within(a, b, 10); });
                    EXPECT_TRUE(error.starts_with(expected_error)) << error;
                    error = test::refusal([&] { SelfQuery().boxes_within(a, 0); });
                    EXPECT_TRUE(error.starts_with(expected_error)) << error;
                }
                a.begin_step(s.X, other);
                PosedTree fresh = posed(kind);
                fresh.begin_step(s.X, other);
                const auto expected = test::sorted(query.boxes_within(fresh, b, 0));
                EXPECT_GT(expected.size(), 100u);
                EXPECT_EQ(test::sorted(query.boxes_within(a, b, 0)), expected);
                a.begin_pose(s.X);
                EXPECT_EQ(test::refusal([&] { a.whole(); }), "");
            }
}

TEST_F(NonFinite, ManyBodiesTellOfIt) {
    // A vertex of a face in contact that the start of a pose does not read.
    const std::vector<int>& read = tree->nbd->modes.representatives;
    const auto unread = std::ranges::find_if(
        contact, [&](const FacePair& pair) { return std::ranges::find(read, s.F(pair.a, 1)) == read.end(); });
    ASSERT_NE(unread, contact.end());
    const int vertex = s.F(unread->a, 1);
    Vertices bad = s.X;
    bad.row(vertex).setConstant(NAN);
    PosedTree first = posed(BoundKind::boxes), second = posed(BoundKind::nbd);
    first.begin_pose(other);
    second.begin_pose(bad);
    PosedTree* const bodies[] = {&first, &second};
    EXPECT_TRUE(test::refusal([&] {
                    ManyBodyQuery().intersecting(bodies);
                }).starts_with("position of vertex " + std::to_string(vertex) + " is (nan, nan, nan)"));

    bad.setConstant(NAN);
    PosedTree learned = posed(BoundKind::learned_affine);
    EXPECT_TRUE(test::refusal([&] {
                    learned.begin_pose(bad);
                }).starts_with("position of vertex 0 is (nan, nan, nan)"));
    EXPECT_TRUE(PairQuery().intersecting(first, learned).empty());
}

TEST_F(NonFinite, HugeFinitePositionsAreNoError) {
    PosedTree a = posed(BoundKind::nbd), b = posed(BoundKind::boxes);
    const Vertices huge = s.X * 1e30f;
    a.begin_pose(huge);
    b.begin_pose(other);
    PairQuery query;
    EXPECT_EQ(test::listed(query.intersecting(a, b)), test::brute_force_intersecting(huge, s.F, other, s.F));
}

TEST_F(NonFinite, OtherNumbersOfRowsAreRefusedInAllBuilds) {
    const Vertices few = s.X.topRows(20), nodes = hung.rest.topRows(3);
    PosedTree boxes = posed(BoundKind::boxes), affine = posed(BoundKind::affine),
              spheres(tree, BoundKind::exact);
    for (PosedTree* body : {&boxes, &affine, &spheres}) {
        body->begin_pose(s.X);
        EXPECT_EQ(test::refusal([&] { body->begin_pose(few); }),
                  "positions: 20 rows, but the surface has 336 vertices");
        EXPECT_EQ(test::refusal([&] { body->begin_step(s.X, few); }),
                  "end: 20 rows, but the surface has 336 vertices");
        EXPECT_EQ(test::refusal([&] { body->begin_step(few, s.X); }),
                  "start: 20 rows, but the surface has 336 vertices");
        PosedTree b(tree, BoundKind::boxes);
        b.begin_pose(s.X);
        EXPECT_TRUE(PairQuery().intersecting(*body, b).empty()) << "the last pose is over";
    }
    const std::string carriers = std::to_string(hung.rest.rows());
    EXPECT_EQ(test::refusal([&] { affine.begin_pose_of_nodes(nodes); }),
              "nodes: 3 rows, but the surface hangs on " + carriers + " nodes");
    EXPECT_EQ(test::refusal([&] { affine.begin_step_of_nodes(hung.rest, nodes); }),
              "end: 3 rows, but the surface hangs on " + carriers + " nodes");
    EXPECT_EQ(test::refusal([&] { boxes.begin_pose_of_nodes(hung.rest); }),
              "poses of nodes need affine or auto bounds and a tree that hangs on nodes; these are boxes");
    PosedTree plain(shared_exact_tree(s.X, s.F), BoundKind::automatic);
    EXPECT_EQ(
        test::refusal([&] { plain.begin_step_of_nodes(hung.rest, hung.rest); }),
        "poses of nodes need affine or auto bounds and a tree that hangs on nodes; these are auto, of a "
        "tree that does not");
}

TEST_F(NonFinite, PositionsOfARefusedPoseAreNotReadAnyMore) {
    // Under the address sanitizer this fails if anything still refers to the array.
    for (const BoundKind kind : shapes::kinds_of(*tree)) {
        PosedTree a = posed(kind), b = posed(kind);
        b.begin_pose(other);
        {
            const auto x = std::make_unique<Vertices>(s.X.topRows(100));
            EXPECT_NE(test::refusal([&] { a.begin_pose(*x); }), "");
        }
        EXPECT_TRUE(PairQuery().within(a, b, 10).empty()) << name(kind);
        EXPECT_FALSE(ClosestQuery().closest(a, b)) << name(kind);
    }
}

}  // namespace
}  // namespace nbd

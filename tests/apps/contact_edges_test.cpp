#include "apps/extras/contact_edges.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/support/box_body.hpp"
#include "tests/support/brute_force.hpp"

namespace nbd {
namespace {

constexpr ContactDistances distances{0.0625, 0.03125};

/// A long bar, as a surface and bent into poses.
class ContactEdges : public ::testing::Test {
 protected:
    ContactEdges()
        : body_(test::box_body({2, 0.25, 0.25}, {16, 2, 2})),
          surface_(std::make_shared<const ContactEdgeSurface>(
              shared_exact_tree(body_.surface.X.cast<float>(), body_.surface.F), body_.W.cast<float>(),
              body_.surface.X.cast<float>(), distances)) {}

    /// Nodes of the bar bent about the z axis so that its ends come around, moved by `by`.
    Vertices bent(double angle, const Eigen::RowVector3d& by = {0, 0, 0}) const {
        Nodes x = body_.tets.X;
        if (angle != 0) {
            const double radius = 2 / angle;
            for (Eigen::Index i = 0; i < x.rows(); ++i) {
                const double turn = x(i, 0) / radius, r = radius - x(i, 1);
                x.row(i) << r * std::sin(turn), radius - r * std::cos(turn), x(i, 2);
            }
        }
        return (x.rowwise() + by).cast<float>();
    }

    Vertices on_surface(const Vertices& nodes) const {
        Vertices x;
        apply_embedding(surface_->W, nodes, x);
        return x;
    }

    /// Pairs of the body with itself, from every face against every other.
    std::vector<ContactEdge> expected_within(const Vertices& nodes, int id) const {
        const Faces& F = body_.surface.F;
        const Vertices x = on_surface(nodes), rest = body_.surface.X.cast<float>();
        const auto left_out = test::brute_force_within(rest, F, rest, F, 2 * distances.self);
        std::vector<ContactEdge> edges;
        for (const FacePair& pair : test::brute_force_within(x, F, x, F, distances.self)) {
            bool shares = pair.a >= pair.b || std::ranges::binary_search(left_out, pair);
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) shares = shares || F(pair.a, i) == F(pair.b, j);
            if (!shares) edges.push_back({pair.a, id, pair.b});
        }
        return edges;
    }

    Body body_;
    std::shared_ptr<const ContactEdgeSurface> surface_;
};

TEST_F(ContactEdges, WithinABodyAreThoseOfBruteForce) {
    ContactEdgeFinder finder({surface_}, {4}, {});
    const Vertices apart = bent(0), closed = bent(6.4);
    EXPECT_TRUE(finder.find(std::vector{apart}, 0).front().empty());
    const std::vector<ContactEdge> expected = expected_within(closed, 4);
    ASSERT_GT(expected.size(), 20u);
    EXPECT_EQ(finder.find(std::vector{closed}, 0).front(), expected);
}

TEST_F(ContactEdges, OfTwoBodiesAreSeenFromBothSides) {
    ContactEdgeFinder finder({surface_, surface_}, {0, 1}, {});
    const std::vector<Vertices> nodes{bent(0), bent(1, {0.1, 0.28, 0.05})};
    const auto found = finder.find(nodes, 0);
    std::vector<ContactEdge> of_a, of_b;
    const Vertices xa = on_surface(nodes[0]), xb = on_surface(nodes[1]);
    for (const FacePair& pair :
         test::brute_force_within(xa, body_.surface.F, xb, body_.surface.F, distances.bodies)) {
        of_a.push_back({pair.a, 1, pair.b});
        of_b.push_back({pair.b, 0, pair.a});
    }
    std::ranges::sort(of_b);
    ASSERT_GT(of_a.size(), 20u);
    EXPECT_EQ(found[0], of_a);
    EXPECT_EQ(found[1], of_b);

    ContactEdgeFinder with_unrecorded({surface_, surface_}, {0, unrecorded_partner}, {});
    const auto half = with_unrecorded.find(nodes, 0);
    for (ContactEdge& edge : of_a) edge.partner = unrecorded_partner;
    EXPECT_EQ(half[0], of_a);
    EXPECT_TRUE(half[1].empty());
}

TEST_F(ContactEdges, WithObstaclesAreFacesWithAVertexNearThem) {
    const std::vector<Obstacle> planes{
        {.shape = PlaneShape{.point = {0, 0, -0.17}, .normal = Eigen::Vector3d::UnitZ()}},
        {.shape = PlaneShape{.point = {1.2, 0, 0}, .normal = -Eigen::Vector3d::UnitX()},
         .motion = travel({-0.1, 0, 0})}};
    ContactEdgeFinder finder({surface_}, {0}, planes);
    const Vertices x = on_surface(bent(0));
    for (const double time : {0.0, 3.0}) {
        std::vector<ContactEdge> expected;
        for (int f = 0; f < body_.surface.F.rows(); ++f) {
            bool below = false, right = false;
            for (const int v : body_.surface.F.row(f)) {
                below = below || x(v, 2) + 0.17 <= distances.bodies;
                right = right || 1.2 - 0.1 * time - x(v, 0) <= distances.bodies;
            }
            if (right) expected.push_back({f, obstacle_partner(1), -1});
            if (below) expected.push_back({f, obstacle_partner(0), -1});
        }
        EXPECT_EQ(finder.find(std::vector{bent(0)}, time).front(), expected);
        std::set<int> partners;
        for (const ContactEdge& edge : expected) partners.insert(edge.partner);
        EXPECT_EQ(partners.size(), time > 0 ? 2u : 1u);
    }
}

}  // namespace
}  // namespace nbd

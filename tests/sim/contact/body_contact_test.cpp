#include "sim/contact/body_contact.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "collision/base/counter_random.hpp"
#include "collision/geometry/closest_points.hpp"
#include "sim/contact/nearest_face.hpp"
#include "tests/sim/contact/find_contacts.hpp"
#include "tests/support/box_body.hpp"

namespace nbd {
namespace {

/// A cube of 2 m with its upper side at z = 0, and a small cube that has sunk into it by `depth`.
class SunkCube : public testing::Test {
 protected:
    SunkCube()
        : ground_body_(test::box_body({2, 2, 2}, {1, 1, 1})),
          cube_body_(test::box_body({0.2, 0.2, 0.2}, {1, 1, 1})),
          ground(shape(ground_body_), ground_body_.tets.X.rowwise() - Eigen::RowVector3d(0, 0, 1)),
          cube(shape(cube_body_), cube_body_.tets.X) {}

    /// Depth of the deepest vertex of the small cube in contact, metres; 0 if none is below the surface.
    double deepest(double depth, double moved) {
        cube.update(cube_body_.tets.X.rowwise() + Eigen::RowVector3d(0.3, 0.2, 0.1 - depth));
        const test::ContactSearch search{.reach = {.apart = 0.01, .inside = 0.08}, .moved = moved};
        double deepest = 0;
        for (const Contact& contact : test::find_contacts(finder, cube, ground, search))
            if (contact.a.body == 0 && contact.a.count == 1) deepest = std::max(deepest, -contact.gap);
        return deepest;
    }

    BodyContactFinder finder{0, 1};

 private:
    static std::shared_ptr<const ContactShape> shape(const Body& body) {
        return std::make_shared<const ContactShape>(body.W, body.surface.F, body.tets.X);
    }
    Body ground_body_, cube_body_;

 protected:
    ContactSurface ground, cube;
};

TEST_F(SunkCube, IsInContactAtAnyDepthWithinReachWithoutAHistory) {
    EXPECT_NEAR(deepest(0.06, std::numeric_limits<double>::infinity()), 0.06, 1e-12);
    EXPECT_NEAR(finder.deepest(), 0.06, 1e-12);
}

TEST_F(SunkCube, IsNotInContactDeeperThanItCanHaveMoved) {
    EXPECT_EQ(deepest(0.06, 0.05), 0);
    EXPECT_NEAR(deepest(0.04, 0.05), 0.04, 1e-12);
}

TEST_F(SunkCube, MaySinkDeeperStepByStep) {
    EXPECT_NEAR(deepest(0.03, 0.035), 0.03, 1e-12);
    EXPECT_NEAR(deepest(0.06, 0.035), 0.06, 1e-12) << "0.03 m deep before, moved by 0.035 m since";
    EXPECT_EQ(deepest(0.09, 0.035), 0) << "beyond reach";
    EXPECT_EQ(finder.deepest(), 0);
}

TEST_F(SunkCube, IsRecognisedAfterSavingAndRestoringSides) {
    deepest(0.03, 0.035);
    ContactSides sides;
    finder.save_sides(sides);
    ASSERT_EQ(sides.depths.size(), sides.vertices.size());
    finder = BodyContactFinder(0, 1);
    finder.restore_sides(sides);
    EXPECT_NEAR(deepest(0.06, 0.035), 0.06, 1e-12);
}

/// Two crumpled boxes, one above the other, whose surfaces are finer than their tetrahedra.
class CrumpledBoxes : public testing::Test {
 protected:
    /// tree: whose leaves are the patches; null: one over the rest pose.
    ContactSurface crumpled(std::uint64_t seed, const Eigen::RowVector3d& centre,
                            const WideTree* tree = nullptr) const {
        CounterRandom random(seed, 0);
        Nodes x = body_.tets.X.rowwise() + centre;
        for (double& coordinate : x.reshaped()) coordinate += 0.05 * (random.unit() - 0.5);
        return {std::make_shared<const ContactShape>(body_.W, body_.surface.F, body_.tets.X, tree), x};
    }

    /// A tree whose leaves are faces that follow each other in the file.
    WideTree tree_in_file_order() const {
        std::vector<int> order(body_.surface.F.rows());
        std::iota(order.begin(), order.end(), 0);
        return build_wide_tree(order, body_.surface.F, body_.W.rows());
    }

    /// The contacts of a first search.
    static std::vector<Contact> contacts(const ContactSurface& a, const ContactSurface& b,
                                         const test::ContactSearch& search, long* measured = nullptr) {
        BodyContactFinder finder(0, 1);
        return test::find_contacts(finder, a, b, search, measured);
    }

    /// Signed distance of a point, from all faces.
    static double distance_to(const ContactSurface& surface, const Eigen::Vector3d& p) {
        ClosestPoints nearest{};
        nearest.distance = std::numeric_limits<double>::infinity();
        int face = -1;
        for (int f = 0; f < surface.F().rows(); ++f) {
            const auto corners = surface.F().row(f);
            const ClosestPoints closest = closest_point_triangle(
                p, surface.x(corners[0]), surface.x(corners[1]), surface.x(corners[2]));
            if (closest.distance < nearest.distance) nearest = closest, face = f;
        }
        return nearest.gap.dot(surface.feature_normal(face, nearest.weights_b)) < 0 ? -nearest.distance
                                                                                    : nearest.distance;
    }

 private:
    Body body_ = test::fine_box_body({1, 0.6, 0.3}, {5, 3, 2}, 2);
};

/// Vertices with faces, both ways, and edges with edges that are at most this far apart, from all pairs.
long near_features(const ContactSurface& a, const ContactSurface& b, double distance) {
    long near = 0;
    for (const auto& [points, faces] : {std::pair{&a, &b}, std::pair{&b, &a}})
        for (int v = 0; v < points->vertex_count(); ++v)
            for (int f = 0; f < faces->F().rows(); ++f)
                near += closest_point(*faces, f, points->x(v)).distance <= distance;
    const auto &edges_a = a.topology().edges, &edges_b = b.topology().edges;
    for (int i = 0; i < edges_a.rows(); ++i)
        for (int j = 0; j < edges_b.rows(); ++j)
            near += closest_edge_edge(a.x(edges_a(i, 0)), a.x(edges_a(i, 1)), b.x(edges_b(j, 0)),
                                      b.x(edges_b(j, 1)))
                        .distance <= distance;
    return near;
}

TEST_F(CrumpledBoxes, HaveFewerPairsMeasuredThanAreNear) {
    const ContactReach reach{.apart = 0.03, .inside = 0.04};
    const ContactSurface a = crumpled(3, {0, 0, 0}), b = crumpled(103, {0.1, 0.05, 0.3});
    long measured = 0;
    const std::size_t found = contacts(a, b, {.reach = reach}, &measured).size();
    EXPECT_GT(found, 50u);
    EXPECT_GE(measured, long(found));
    EXPECT_LE(measured, near_features(a, b, reach.most()));
}

TEST_F(CrumpledBoxes, HaveEveryContactOfAVertexThatAllFacesGive) {
    const ContactReach reach{.apart = 0.03, .inside = 0.04};
    int outside = 0, inside = 0;
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
        const ContactSurface surfaces[] = {crumpled(seed, {0, 0, 0}),
                                           crumpled(seed + 100, {0.1, 0.05, 0.29 + 0.01 * double(seed)})};
        std::map<int, double> found[2];
        for (const Contact& contact : contacts(surfaces[0], surfaces[1], {.reach = reach}))
            if (contact.a.count == 1) found[contact.a.body][contact.a.vertices[0]] = contact.gap;
        for (std::size_t body = 0; body < 2; ++body)
            for (int v = 0; v < surfaces[body].vertex_count(); ++v) {
                const double gap = distance_to(surfaces[1 - body], surfaces[body].x(v));
                const auto contact = found[body].find(v);
                ASSERT_EQ(contact != found[body].end(), gap <= reach.apart && -gap <= reach.inside)
                    << "vertex " << v << " at " << gap;
                if (contact == found[body].end()) continue;
                EXPECT_NEAR(contact->second, gap, 1e-12);
                ++(gap < 0 ? inside : outside);
            }
    }
    EXPECT_GT(outside, 100);
    EXPECT_GT(inside, 100);
}

TEST_F(CrumpledBoxes, ReachAsFarAsTheyMove) {
    const ContactSurface a = crumpled(1, {0, 0, 0}), b = crumpled(101, {0.1, 0.05, 0.34});
    const ContactReach still{.apart = 0.01, .inside = 0.01}, far{.apart = 0.03, .inside = 0.03},
        moving{.apart = 0.01, .inside = 0.01, .approach = 0.025};
    const auto count = [&](const ContactReach& reach, double v) {
        return contacts(a, b, {.reach = reach, .velocity = {0, 0, v}}).size();
    };
    EXPECT_LT(count(still, -4), count(far, 0));
    EXPECT_EQ(count(moving, 0), count(still, 0));
    EXPECT_EQ(count(moving, -4), count(far, 0)) << "0.02 m in a step";
    EXPECT_GT(count(moving, -5), count(far, 0));
    EXPECT_EQ(count(moving, -50), count(moving, -5)) << "at most 0.025 m";
}

TEST_F(CrumpledBoxes, LeaveShortEdgesToTheirVertices) {
    const ContactSurface a = crumpled(1, {0, 0, 0}), b = crumpled(101, {0.1, 0.05, 0.33});
    const auto edges = [&](double apart, ContactDetail detail) {
        const auto found = contacts(a, b, {.reach = {.apart = apart, .inside = apart}, .detail = detail});
        return std::ranges::count(found, 2, [](const Contact& contact) { return contact.a.count; });
    };
    EXPECT_GT(edges(0.06, ContactDetail::all), 10);
    EXPECT_EQ(edges(0.06, ContactDetail::enough), edges(0.06, ContactDetail::all))
        << "long beside the distance";
    EXPECT_GT(edges(0.4, ContactDetail::all), 10);
    EXPECT_EQ(edges(0.4, ContactDetail::enough), 0);
}

TEST_F(CrumpledBoxes, HaveContactsThatDoNotDependOnThePatches) {
    const WideTree other = tree_in_file_order();
    int edges = 0, left_out = 0;
    for (const double apart : {0.1, 0.15, 0.2, 0.25}) {
        const auto found = [&](const WideTree* tree, ContactDetail detail) {
            const ContactSurface a = crumpled(1, {0, 0, 0}, tree), b = crumpled(101, {0.1, 0.05, 0.33}, tree);
            std::vector<std::tuple<int, std::array<int, 3>, std::array<int, 3>, double>> all;
            for (const Contact& c :
                 contacts(a, b, {.reach = {.apart = apart, .inside = apart}, .detail = detail}))
                all.emplace_back(c.a.count, c.a.vertices, c.b.vertices, c.gap);
            std::ranges::sort(all);
            return all;
        };
        const auto enough = found(nullptr, ContactDetail::enough);
        EXPECT_EQ(enough, found(&other, ContactDetail::enough)) << apart;
        const auto all = found(nullptr, ContactDetail::all);
        EXPECT_EQ(all, found(&other, ContactDetail::all)) << apart;
        edges += std::ranges::count_if(enough, [](const auto& c) { return std::get<0>(c) == 2; });
        left_out += all.size() - enough.size();
    }
    EXPECT_GT(edges, 10);
    EXPECT_GT(left_out, 10);
}

TEST_F(CrumpledBoxes, HaveContactsOfEdgesThatPointFromOneEdgeToTheOther) {
    const ContactReach reach{.apart = 0.06, .inside = 0.06};
    int apart = 0, inside = 0;
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
        const ContactSurface a = crumpled(seed, {0, 0, 0}),
                             b = crumpled(seed + 100, {0.1, 0.05, seed < 3 ? 0.33 : 0.27});
        for (const Contact& contact : contacts(a, b, {.reach = reach})) {
            if (contact.a.count != 2) continue;
            const auto place = [](const SurfacePoint& point, const ContactSurface& surface) {
                return Eigen::Vector3d(point.weights[0] * surface.x(point.vertices[0]) +
                                       point.weights[1] * surface.x(point.vertices[1]));
            };
            const Eigen::Vector3d from_b = place(contact.a, a) - place(contact.b, b);
            EXPECT_LT((from_b - contact.gap * contact.normal).norm(), 1e-12);
            EXPECT_NEAR(contact.normal.norm(), 1, 1e-12);
            (contact.gap > 0 ? apart : inside) += 1;
        }
    }
    EXPECT_GT(apart, 10);
    EXPECT_GT(inside, 10);
}

TEST_F(CrumpledBoxes, HaveEveryContactOfEdgesThatAreNoFartherApartThanTheyAreLong) {
    const ContactReach reach{.apart = 0.06, .inside = 0.06};
    int expected_contacts = 0, too_far = 0;
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
        const ContactSurface a = crumpled(seed, {0, 0, 0}), b = crumpled(seed + 100, {0.1, 0.05, 0.33});
        std::set<std::pair<std::pair<int, int>, std::pair<int, int>>> found, expected;
        for (const Contact& contact : contacts(a, b, {.reach = reach}))
            if (contact.a.count == 2 && contact.gap > 0)
                found.insert({{contact.a.vertices[0], contact.a.vertices[1]},
                              {contact.b.vertices[0], contact.b.vertices[1]}});
        const auto ends = [](const ContactSurface& s, int edge) {
            return std::pair(s.topology().edges(edge, 0), s.topology().edges(edge, 1));
        };
        for (int i = 0; i < a.topology().edges.rows(); ++i)
            for (int j = 0; j < b.topology().edges.rows(); ++j) {
                const auto [p, q] = ends(a, i);
                const auto [u, v] = ends(b, j);
                const Eigen::Vector3d along_a = a.x(q) - a.x(p), along_b = b.x(v) - b.x(u);
                if ((a.x(p) - b.x(u)).norm() > reach.apart + along_a.norm() + along_b.norm()) continue;
                if (along_a.cross(along_b).norm() < 1e-3 * along_a.norm() * along_b.norm()) continue;
                const ClosestPoints closest = closest_edge_edge(a.x(p), a.x(q), b.x(u), b.x(v));
                const double length = closest.distance, s = closest.weights_a[1], t = closest.weights_b[1];
                if (length <= reach.apart && s > 0 && s < 1 && t > 0 && t < 1 &&
                    closest.gap.dot(b.edge_normal(j)) > 1e-3 * length &&
                    -closest.gap.dot(a.edge_normal(i)) > 1e-3 * length) {
                    if (length <= std::max(along_a.norm(), along_b.norm()))
                        expected.insert({{p, q}, {u, v}});
                    else
                        ++too_far;
                }
            }
        EXPECT_EQ(found, expected);
        expected_contacts += expected.size();
    }
    EXPECT_GT(expected_contacts, 100);
    EXPECT_GT(too_far, 10);
}

}  // namespace
}  // namespace nbd

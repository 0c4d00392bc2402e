#include "sim/barrier/near_features.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "sim/barrier/intersections.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

double distance(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces, double share) {
    std::array<Eigen::Vector3d, 4> x;
    const auto at = corners(pair, surfaces);
    for (std::size_t k = 0; k < 4; ++k) x[k] = surfaces[at[k].surface].at(at[k].vertex, share);
    return closest_points(pair.kind, x).distance;
}

double distance_at_rest(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces) {
    std::array<Eigen::Vector3d, 4> x;
    const auto at = corners(pair, surfaces);
    for (std::size_t k = 0; k < 4; ++k) x[k] = surfaces[at[k].surface].rest().row(at[k].vertex);
    return closest_points(pair.kind, x).distance;
}

/// All pairs of features without a common vertex.
std::vector<FeaturePair> all_pairs(const std::vector<MovingSurface>& surfaces) {
    std::vector<FeaturePair> pairs;
    const int count = surfaces.size();
    for (int s = 0; s < count; ++s)
        for (int t = 0; t < count; ++t) {
            const MovingSurface &a = surfaces[s], &b = surfaces[t];
            if (a.is_obstacle() && b.is_obstacle()) continue;
            for (int v = 0; v < a.rest().rows(); ++v)
                for (int f = 0; f < b.F().rows(); ++f)
                    if (s != t || !(b.F().row(f).array() == v).any())
                        pairs.push_back({FeatureKind::vertex_face, s, t, v, f});
            if (t < s) continue;
            const auto &ea = a.topology().edges, &eb = b.topology().edges;
            for (int e = 0; e < ea.rows(); ++e)
                for (int f = s == t ? e + 1 : 0; f < eb.rows(); ++f)
                    if (s != t || (ea(e, 0) != eb(f, 0) && ea(e, 0) != eb(f, 1) && ea(e, 1) != eb(f, 0) &&
                                   ea(e, 1) != eb(f, 1)))
                        pairs.push_back({FeatureKind::edge_edge, s, t, e, f});
        }
    return pairs;
}

/// A flat box, bent so that its ends meet, a second one that flies through, and an obstacle.
std::vector<MovingSurface> scene() {
    std::vector<MovingSurface> surfaces;
    const Body strip = test::box_body({1, 0.15, 0.05}, {10, 2, 1}),
               box = test::box_body({0.3, 0.2, 0.2}, {2, 2, 2});
    surfaces.emplace_back(strip.surface.F, strip.surface.X, 0);
    surfaces.emplace_back(box.surface.F, box.surface.X, 1);
    surfaces.emplace_back(box.surface.F, box.surface.X, -1);
    const auto bent = [&](double angle) {
        Nodes x = strip.surface.X;
        for (Eigen::Index i = 0; i < x.rows(); ++i) {
            const double along = strip.surface.X(i, 0) * angle, r = 1 / angle + strip.surface.X(i, 2);
            x.row(i) = Eigen::RowVector3d(r * std::sin(along), strip.surface.X(i, 1), r * std::cos(along));
        }
        return x;
    };
    const Eigen::RowVector3d from(-0.3, 0, 0.35), to(0.2, 0.05, 0.1), wall(0, 0.3, 0);
    surfaces[0].move(bent(5.4), bent(6.1));
    surfaces[1].move(box.surface.X.rowwise() + from, box.surface.X.rowwise() + to);
    surfaces[2].move(box.surface.X.rowwise() + wall, box.surface.X.rowwise() + 0.9 * wall);
    return surfaces;
}

TEST(NearFeatures, HoldAllPairsThatComeWithinTheirReach) {
    std::vector<MovingSurface> surfaces = scene();
    NearFeatureSearch search;
    search.begin(surfaces, {});
    constexpr double reach = 0.03;
    const auto found = search.find(surfaces, reach);
    std::set<FeaturePair> pairs;
    for (const NearFeatures& near : found) {
        EXPECT_LE(near.reach, reach);
        EXPECT_TRUE(pairs.insert(near.pair).second) << "twice";
    }
    int between = 0, within = 0;
    for (const FeaturePair& pair : all_pairs(surfaces)) {
        double least = 1, pair_reach = reach;
        for (int s = 0; s <= 8; ++s) least = std::min(least, distance(pair, surfaces, s / 8.0));
        if (pair.surface_a == pair.surface_b && least < reach)
            pair_reach = std::min(reach, HostProof::least_share * distance_at_rest(pair, surfaces));
        if (least > pair_reach) continue;
        EXPECT_TRUE(pairs.contains(pair))
            << pair.surface_a << ' ' << pair.surface_b << ' ' << pair.a << ' ' << pair.b;
        ++(pair.surface_a == pair.surface_b ? within : between);
    }
    EXPECT_GT(between, 50);
    EXPECT_GT(within, 20);
    EXPECT_LT(pairs.size(), all_pairs(surfaces).size() / 4);
}

TEST(NearFeatures, DoNotDependOnTheMotionsBefore) {
    std::vector<MovingSurface> surfaces = scene();
    constexpr double reach = 0.01;
    NearFeatureSearch search;
    search.begin(surfaces, {});
    std::vector<Nodes> begin, end;
    for (const MovingSurface& s : surfaces) {
        begin.push_back(s.begin_points());
        end.push_back(s.end_points());
    }
    int asked = 0, looked = 0;
    std::size_t least = 1'000'000, most = 0;
    for (int k = 0; k < 60; ++k) {
        // From hardly a change of the motion to one of many reaches, of each surface another one.
        for (std::size_t s = 0; s < surfaces.size(); ++s) {
            const double by = reach * std::pow(10.0, k / 3 % 5 + (k + static_cast<int>(s)) % 2 - 4);
            Nodes to = end[s], from = begin[s] + (k % 10) / 10.0 * (end[s] - begin[s]);
            for (Eigen::Index i = 0; i < to.rows(); ++i)
                to.row(i) +=
                    by * Eigen::RowVector3d(std::sin(k + i), std::cos(3 * k + i), std::sin(5 * k - i));
            surfaces[s].move(from, to);
        }
        NearFeatureSearch fresh;
        fresh.begin(surfaces, {});
        const auto expected = fresh.find(surfaces, reach);
        const auto found = search.find(surfaces, reach);
        ASSERT_TRUE(std::ranges::equal(found, expected)) << k;
        ++(search.costs().face_pairs > 0 ? asked : looked);
        least = std::min(least, found.size());
        most = std::max(most, found.size());
    }
    EXPECT_GT(asked, 5);
    EXPECT_GT(looked, 5);
    EXPECT_LT(least, most / 2);
}

std::vector<Intersection> intersections_of(std::vector<MovingSurface>& surfaces) {
    IntersectionSearch search;
    search.begin(surfaces, 0);
    return search.find(surfaces);
}

TEST(Intersections, AreNoneForBoxesApart) {
    const Body box = test::box_body({1, 1, 1}, {2, 2, 2});
    std::vector<MovingSurface> surfaces;
    for (int b = 0; b < 2; ++b) surfaces.emplace_back(box.surface.F, box.surface.X, b);
    // By far less than single precision resolves.
    const Nodes beside = box.surface.X.rowwise() + Eigen::RowVector3d(1 + 1e-12, 0, 0);
    surfaces[1].move(beside, beside);
    EXPECT_TRUE(intersections_of(surfaces).empty());
    const Nodes touching = box.surface.X.rowwise() + Eigen::RowVector3d(1, 0, 0);
    surfaces[1].move(touching, touching);
    EXPECT_FALSE(intersections_of(surfaces).empty());
}

TEST(Intersections, AreNamedByBodyAndFace) {
    const Body box = test::box_body({1, 1, 1}, {2, 2, 2});
    std::vector<MovingSurface> surfaces;
    surfaces.emplace_back(box.surface.F, box.surface.X, 0);
    surfaces.emplace_back(box.surface.F, box.surface.X, -1);
    const Nodes inside = 0.9 * box.surface.X;
    surfaces[1].move(inside, inside);
    EXPECT_TRUE(intersections_of(surfaces).empty());  // surfaces, not solids, are tested
    const Nodes across = box.surface.X.rowwise() + Eigen::RowVector3d(0.4, 0.3, 0.2);
    surfaces[1].move(across, across);
    const std::vector<Intersection> found = intersections_of(surfaces);
    ASSERT_GT(found.size(), 3u);
    const std::string text = intersection_text(found, surfaces);
    EXPECT_NE(text.find(" face pairs intersect: face "), std::string::npos) << text;
    EXPECT_NE(text.find(" of body 0 and face "), std::string::npos) << text;
    EXPECT_NE(text.find(" of obstacle mesh 0, "), std::string::npos) << text;
    EXPECT_TRUE(text.ends_with(" ...")) << text;
}

/// A vertex pulled through the far side of its own body, or through a face beside it.
TEST(Intersections, AreFoundWithinABody) {
    const Body box = test::box_body({1, 1, 1}, {3, 3, 3});
    Eigen::Index corner = 0, middle = 0;
    (box.surface.X.rowwise() - Eigen::RowVector3d(0.5, 0.5, 0.5)).rowwise().norm().minCoeff(&corner);
    (box.surface.X.rowwise() - Eigen::RowVector3d(0.17, 0.17, 0.5)).rowwise().norm().minCoeff(&middle);
    std::vector<MovingSurface> surfaces;
    surfaces.emplace_back(box.surface.F, box.surface.X, 0);
    EXPECT_TRUE(intersections_of(surfaces).empty());
    Nodes x = box.surface.X;
    x.row(middle) << 0.17, 0.17, -0.7;
    surfaces[0].move(x, x);
    EXPECT_FALSE(intersections_of(surfaces).empty());
    // A corner folded into the plane of the faces beside it: only faces with common vertices meet.
    x = box.surface.X;
    x.row(corner) << 0.1, 0.12, 0.5;
    surfaces[0].move(x, x);
    const std::vector<Intersection> folded = intersections_of(surfaces);
    ASSERT_FALSE(folded.empty());
    for (const Intersection& pair : folded) EXPECT_EQ(pair.surface_a, pair.surface_b);
}

}  // namespace
}  // namespace nbd

#include "collision/continuous/feature_query.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <set>
#include <vector>

#include "collision/base/counter_random.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

using Eigen::RowVector3d;
using Eigen::Vector3d;

/// Two faces with the common edge 0-1, whose outer vertices come to meet.
struct Hinge {
    Nodes begin = Nodes(4, 3), end;
    Faces F = Faces(2, 3);

    Hinge() {
        begin << 0, 0, 0, 1, 0, 0, 0.5, 1, 0, 0.5, 0.8, 0.5;
        end = begin;
        end.row(3) << 0.5, 0.5, -0.5;
        F << 0, 1, 2, 1, 0, 3;
    }
};

Nodes nodes(const shapes::Surface& s) { return s.X.cast<double>(); }

/// Folds a surface up and blows at it, so that it meets itself.
Nodes crumpled(const Nodes& X, double strength, std::uint64_t seed) {
    CounterRandom random(seed, 0);
    Nodes x = X;
    for (Eigen::Index v = 0; v < x.rows(); ++v) {
        const Vector3d by(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        x.row(v) += strength * by.transpose();
    }
    return x;
}

/// All pairs of features without a common vertex, by definition.
std::vector<FeaturePair> all_pairs(const std::vector<MovingBody>& bodies) {
    std::vector<FeaturePair> pairs;
    const int count = bodies.size();
    for (int s = 0; s < count; ++s)
        for (int t = 0; t < count; ++t) {
            const MovingBody &a = bodies[s], &b = bodies[t];
            if (a.is_obstacle() && b.is_obstacle()) continue;
            std::set<int> vertices;
            std::set<std::pair<int, int>> edges_a, edges_b;
            for (const auto& [body, edges] : {std::pair(&a, &edges_a), std::pair(&b, &edges_b)})
                for (Eigen::Index f = 0; f < body->F().rows(); ++f)
                    for (int k = 0; k < 3; ++k)
                        edges->insert(std::minmax({body->F()(f, k), body->F()(f, (k + 1) % 3)}));
            for (Eigen::Index f = 0; f < a.F().rows(); ++f)
                for (int k = 0; k < 3; ++k) vertices.insert(a.F()(f, k));
            for (const int v : vertices)
                for (int f = 0; f < b.F().rows(); ++f)
                    if (s != t || !(b.F().row(f).array() == v).any())
                        pairs.push_back({FeatureKind::vertex_face, s, t, v, f});
            if (t < s) continue;
            int e = 0;
            for (const auto& [i, j] : edges_a) {
                int f = 0;
                for (const auto& [k, l] : edges_b) {
                    if (s != t || (e < f && i != k && i != l && j != k && j != l))
                        pairs.push_back({FeatureKind::edge_edge, s, t, e, f});
                    ++f;
                }
                ++e;
            }
        }
    std::ranges::sort(pairs);
    return pairs;
}

/// Distance of the boxes of both features over the step, those of one body relative to its mean motion.
double boxes_apart(const FeaturePair& pair, const std::vector<MovingBody>& bodies) {
    const MovingBody &a = bodies[pair.surface_a], &b = bodies[pair.surface_b];
    RowVector3d frame = RowVector3d::Zero();
    if (&a == &b) frame = a.end().colwise().mean() - a.begin().colwise().mean();
    const auto at = feature_vertices(pair, a, b);
    const std::size_t split = corners_of_a(pair.kind);
    std::array<RowVector3d, 2> low, high;
    low.fill(RowVector3d::Constant(1e300));
    high.fill(RowVector3d::Constant(-1e300));
    for (std::size_t k = 0; k < 4; ++k) {
        const std::size_t side = k < split ? 0 : 1;
        const MovingBody& body = side == 0 ? a : b;
        for (const RowVector3d& p :
             {RowVector3d(body.begin().row(at[k])), RowVector3d(body.end().row(at[k]) - frame)}) {
            low[side] = low[side].cwiseMin(p);
            high[side] = high[side].cwiseMax(p);
        }
    }
    return (low[0] - high[1]).cwiseMax(low[1] - high[0]).cwiseMax(0).stableNorm();
}

std::vector<FeaturePair> near_pairs(const std::vector<MovingBody>& bodies, double distance) {
    std::vector<FeaturePair> pairs = all_pairs(bodies);
    std::erase_if(pairs, [&](const FeaturePair& pair) { return boxes_apart(pair, bodies) > distance; });
    return pairs;
}

std::vector<FeaturePair> candidates(std::vector<MovingBody>& bodies, double distance) {
    FeatureQuery query;
    const auto found = query.candidates(bodies, distance);
    return {found.begin(), found.end()};
}

/// Counts of pairs of one body whose owners have a common vertex, and of pairs of two bodies.
struct Kinds {
    std::size_t around_vertices = 0, of_one = 0, of_two = 0;
};
Kinds kinds(const std::vector<FeaturePair>& pairs, const std::vector<MovingBody>& bodies) {
    Kinds result;
    std::vector<std::vector<FeaturePair>> neighbours;
    for (int b = 0; b < std::ssize(bodies); ++b) {
        const MovingBody& body = bodies[b];
        neighbours.push_back(neighbour_features(body.F(), body.features(), b));
    }
    for (const FeaturePair& pair : pairs) {
        if (pair.surface_a != pair.surface_b)
            ++result.of_two;
        else if (std::ranges::binary_search(neighbours[pair.surface_a], pair))
            ++result.around_vertices;
        else
            ++result.of_one;
    }
    return result;
}

/// A crumpled torus, a ball that flies through it, and two obstacles, in a step. `place` takes positions to
/// where the test wants them.
std::vector<MovingBody> scene(const std::function<Nodes(const Nodes&)>& place) {
    const shapes::Surface torus = shapes::torus(10, 7), ball = shapes::sphere(6, 8, 0.2f);
    std::vector<MovingBody> bodies;
    bodies.emplace_back(place(nodes(torus)), torus.F);
    bodies.emplace_back(place(nodes(ball)), ball.F);
    bodies.emplace_back(place(nodes(ball)), ball.F, BodyRole::obstacle);
    bodies.emplace_back(place(nodes(ball)), ball.F, BodyRole::obstacle);
    const RowVector3d from(0.5, 0.1, 0.6), to(0.4, 0.2, -0.3), by(10, 0, 0);
    bodies[0].move(place(crumpled(nodes(torus), 0.04, 1)),
                   place(crumpled(nodes(torus), 0.06, 2).rowwise() + 0.02 * by));
    bodies[1].move(place(nodes(ball).rowwise() + from), place(nodes(ball).rowwise() + to));
    bodies[2].pose(place(nodes(ball).rowwise() + RowVector3d(-0.5, 0, 0.3)));
    bodies[3].pose(place(nodes(ball).rowwise() + RowVector3d(-0.5, 0, 0.35)));
    return bodies;
}

void expect_as_brute_force(std::vector<MovingBody>& bodies, double distance) {
    const std::vector<FeaturePair> expected = near_pairs(bodies, distance),
                                   found = candidates(bodies, distance);
    EXPECT_EQ(found, expected);
    const Kinds of = kinds(expected, bodies);
    EXPECT_GT(of.around_vertices, 200u);
    EXPECT_GT(of.of_one, 100u);
    EXPECT_GT(of.of_two, 300u);
    EXPECT_LT(expected.size(), all_pairs(bodies).size() / 4);
}

TEST(FeatureQuery, FindsThePairsWhoseBoxesAreNearInAStep) {
    auto bodies = scene([](const Nodes& x) { return x; });
    for (const double distance : {0.0, 0.01, 0.05}) expect_as_brute_force(bodies, distance);
    EXPECT_EQ(candidates(bodies, 1e30), all_pairs(bodies));
    for (MovingBody& body : bodies) body.pose(body.begin());
    const auto expected = near_pairs(bodies, 0.05), found = candidates(bodies, 0.05);
    EXPECT_EQ(found, expected);
    EXPECT_GT(found.size(), 500u);
}

TEST(FeatureQuery, FindsTheSamePairsFarFromTheOriginAndInAnyUnit) {
    // Multiples of 2^-30, so that moving them by whole numbers is exact.
    const auto rounded = [](const Nodes& x) { return Nodes((x * 0x1p30).array().round() * 0x1p-30); };
    auto here = scene(rounded);
    const auto expected = candidates(here, 0.03);
    ASSERT_GT(expected.size(), 1000u);
    for (const double offset : {1e3, 3e5, 4e6}) {
        auto there = scene([&](const Nodes& x) { return Nodes(rounded(x).array() + offset); });
        EXPECT_EQ(candidates(there, 0.03), expected) << offset;
    }
    for (const double unit : {0x1p-900, 0x1p-140, 0x1p-30, 0x1p40, 0x1p130, 0x1p900}) {
        auto scaled = scene([&](const Nodes& x) { return Nodes(rounded(x) * unit); });
        EXPECT_EQ(candidates(scaled, 0.03 * unit), expected) << unit;
    }
}

TEST(FeatureQuery, FindsDegenerateFeatures) {
    // A fan of six faces at one edge, faces without area, a face with a vertex twice and a loose vertex.
    Nodes X(11, 3);
    X << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 1, 1, 0, -1, 1, 1, 1, 1, 2, 0, 0, 1, 1, 1, 9, 9, 9;
    Faces F(11, 3);
    F << 0, 1, 2, 0, 1, 3, 0, 1, 4, 1, 0, 5, 0, 1, 6, 0, 1, 7, 0, 1, 8, 7, 9, 2, 7, 9, 3, 4, 4, 5, 2, 3, 0;
    std::vector<MovingBody> bodies;
    bodies.emplace_back(X, F);
    bodies.emplace_back(X, F);
    for (const double angle : {0.0, 0.3}) {
        Nodes end = crumpled(X, angle, 4);
        bodies[0].move(X, end);
        bodies[1].move(end.rowwise() + RowVector3d(0.25, 0, 0), X);
        for (const double distance : {0.0, 0.125, 1.0}) {
            const auto found = candidates(bodies, distance);
            EXPECT_TRUE(std::ranges::includes(found, near_pairs(bodies, distance)));
            EXPECT_TRUE(std::ranges::includes(near_pairs(bodies, distance + 1e-13), found));
            EXPECT_GT(found.size(), 100u);
            EXPECT_LT(found.size(), all_pairs(bodies).size());
        }
    }
}

TEST(FeatureQuery, FindsFeaturesThatOnlyFacesWithACommonVertexHold) {
    const Hinge hinge;
    std::vector<MovingBody> bodies;
    bodies.emplace_back(hinge.begin, hinge.F);
    bodies[0].move(hinge.begin, hinge.end);
    const FeaturePair pair{FeatureKind::vertex_face, 0, 0, 3, 0};
    const auto found = candidates(bodies, 0);
    EXPECT_TRUE(std::ranges::binary_search(found, pair));
    const FreeStep step = FeatureQuery().collision_free_step(bodies, 0, 0);
    ASSERT_TRUE(step.limit);
    EXPECT_NEAR(step.share, 0.5, 1e-9);
    EXPECT_EQ(*step.limit, pair);
    EXPECT_NEAR(step.gap, 0.5, 1e-12);
    const FreeStep careful = FeatureQuery().collision_free_step(bodies, 0.1, 0.25);
    EXPECT_NEAR(careful.share, 0.3, 0.02);  // 0.1 + 0.25 (0.5 - 0.1) left of 0.5
    EXPECT_LE(careful.share, 0.3);
}

TEST(FeatureQuery, StopsWhereTheFirstFeaturesComeTooNear) {
    const shapes::Surface ball = shapes::sphere(10, 12, 0.5f);
    std::vector<MovingBody> bodies;
    bodies.emplace_back(nodes(ball), ball.F);
    bodies.emplace_back(nodes(ball), ball.F, BodyRole::obstacle);
    FeatureQuery query;
    const RowVector3d from(3, 0.1, 0.05), to(-3, 0.1, 0.05);
    bodies[0].move(nodes(ball).rowwise() + from, nodes(ball).rowwise() + to);
    const FreeStep step = query.collision_free_step(bodies, 0.01, 0.2);
    ASSERT_TRUE(step.limit);
    EXPECT_FALSE(step.exhausted);
    EXPECT_NE(step.limit->surface_a, step.limit->surface_b);
    // All pairs by themselves, at many times.
    double least_before = 1e30, least_after = 1e30;
    for (const FeaturePair& pair : all_pairs(bodies)) {
        if (pair.surface_a == pair.surface_b) continue;
        const MovingBody &a = bodies[pair.surface_a], &b = bodies[pair.surface_b];
        const auto at = feature_vertices(pair, a, b);
        const auto distance = [&](double share) {
            std::array<Vector3d, 4> x;
            for (std::size_t k = 0; k < 4; ++k) {
                const MovingBody& body = k < corners_of_a(pair.kind) ? a : b;
                x[k] = body.begin().row(at[k]) + share * (body.end().row(at[k]) - body.begin().row(at[k]));
            }
            return closest_points(pair.kind, x).distance;
        };
        least_before = std::min(least_before, distance(step.share));
        least_after = std::min(least_after, distance(step.share + 0.1));
    }
    EXPECT_GT(least_before, 0.01);
    EXPECT_LT(least_after, 0.01);
    // Past it, or away from it, all of the step is free.
    bodies[0].move(nodes(ball).rowwise() + from, nodes(ball).rowwise() + RowVector3d(5, 0, 0));
    const FreeStep away = query.collision_free_step(bodies, 0.01);
    EXPECT_EQ(away.share, 1);
    EXPECT_FALSE(away.limit);
    // Obstacles do not meet each other.
    std::vector<MovingBody> walls;
    for (int i = 0; i < 2; ++i) walls.emplace_back(nodes(ball), ball.F, BodyRole::obstacle);
    EXPECT_TRUE(query.candidates(walls, 1).empty());
    // What is too near at the begin goes nowhere.
    bodies[0].move(nodes(ball).rowwise() + RowVector3d(1.0001, 0, 0), nodes(ball).rowwise() + from);
    const FreeStep stuck = query.collision_free_step(bodies, 0.1);
    EXPECT_EQ(stuck.share, 0);
    EXPECT_LE(stuck.gap, 0.1);
}

/// A ball that slides down beside a larger one, and the loop of the documentation, which holds it at twice
/// the separation before it moves; or one that only stops what approached, after a step was cut.
struct SlidingBall {
    static constexpr double separation = 1e-3, keep = 5e-3, dt = 0.01;
    shapes::Surface ball = shapes::sphere(8, 10, 0.5f), floor = shapes::sphere(12, 16, 4);
    std::vector<MovingBody> bodies;
    FeatureQuery query;
    Nodes x = nodes(ball).rowwise() + RowVector3d(0.3, 0, 4.6);
    RowVector3d v{0.5, 0.2, 0};
    double least = 1, last = 1;  // share of a step

    SlidingBall() {
        bodies.emplace_back(nodes(ball), ball.F);
        bodies.emplace_back(nodes(floor), floor.F, BodyRole::obstacle);
    }
    /// Presses features of the ball and the floor apart that are nearer than `keep`.
    void hold(const FeaturePair& pair, double keep) {
        if (pair.surface_a == pair.surface_b) return;
        const bool ball_is_a = pair.surface_a == 0;
        const auto at = feature_vertices(pair, bodies[pair.surface_a], bodies[pair.surface_b]);
        std::array<Vector3d, 4> y;
        for (std::size_t k = 0; k < 4; ++k) {
            const bool of_a = k < corners_of_a(pair.kind);
            const Nodes& of = of_a == ball_is_a ? x : bodies[1].begin();
            y[k] = of.row(at[k]);
        }
        const ClosestPoints points = closest_points(pair.kind, y);
        const Vector3d normal = (ball_is_a ? 1 : -1) * points.gap.normalized();
        if (points.distance > keep) return;
        const double least_speed = (keep - points.distance) / (2 * dt);
        v += std::max(0.0, least_speed - v.dot(normal)) * normal.transpose();
    }
    void step(bool holds) {
        v[2] -= 9.81 * dt;
        if (holds) {
            bodies[0].pose(x);
            for (const FeaturePair& pair : query.candidates(bodies, keep)) hold(pair, keep);
        }
        bodies[0].move(x, x.rowwise() + dt * v);
        const FreeStep step = query.collision_free_step(bodies, separation);
        x = bodies[0].at(step.share);
        last = step.share;
        least = std::min(least, last);
        if (step.limit && !holds) v -= std::min(0.0, v[2]) * RowVector3d(0, 0, 1);
    }
};

TEST(FeatureQuery, ALoopThatPressesFeaturesApartDoesNotStick) {
    SlidingBall scene;
    bool touched = false;
    for (int i = 0; i < 240; ++i) {
        scene.step(true);
        scene.bodies[0].pose(scene.x);
        touched |= !scene.query.candidates(scene.bodies, scene.keep).empty();
    }
    EXPECT_TRUE(touched);
    EXPECT_GT(scene.least, 0.01);
    EXPECT_LT(scene.x.colwise().mean()[2], 0);  // it slid down beside the floor and fell
    SlidingBall other;
    for (int i = 0; i < 120; ++i) other.step(false);
    EXPECT_EQ(other.last, 0) << "the documentation says so";
}

TEST(FeatureQuery, RefusesWhatItCannotAnswer) {
    Hinge hinge;
    EXPECT_EQ(test::refusal([&] { MovingBody(hinge.begin, Faces(0, 3)); }), "the surface has no faces");
    Faces bad = hinge.F;
    bad(1, 2) = 4;
    EXPECT_EQ(test::refusal([&] { MovingBody(hinge.begin, bad); }),
              "surface: face 1 refers to vertex 4, but there are 4");
    std::vector<MovingBody> bodies;
    bodies.emplace_back(hinge.begin, hinge.F);
    hinge.end(2, 1) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(test::refusal([&] { bodies[0].move(hinge.begin, hinge.end); }),
              "end: position of vertex 2 is not finite");
    EXPECT_EQ(test::refusal([&] { bodies[0].pose(hinge.begin.topRows(3)); }),
              "begin has 3 positions, but the surface has 4 vertices");
    EXPECT_EQ(bodies[0].end(), hinge.begin);
    FeatureQuery query;
    EXPECT_EQ(test::refusal([&] { query.candidates(bodies, -1); }),
              "distance is -1, allowed: finite, 0 or more");
    EXPECT_EQ(test::refusal([&] { query.collision_free_step(bodies, 0, 1); }),
              "left is 1, allowed: 0 or more, below 1");
    EXPECT_TRUE(query.candidates({}, 1).empty());
}

}  // namespace
}  // namespace nbd

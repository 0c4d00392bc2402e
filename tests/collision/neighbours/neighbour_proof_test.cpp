#include "collision/neighbours/neighbour_proof.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "collision/geometry/closest_points.hpp"
#include "collision/query/self_query.hpp"
#include "tests/support/brute_force.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

using shapes::Surface;
using Deformation = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;

struct NamedPose {
    std::string name;
    Deformation deform;
};

/// From stiff motions to ones that no proof can follow.
std::vector<NamedPose> gentle_poses() {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(2, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    return {
        {"moved",
         [=](const Eigen::Vector3d& x) -> Eigen::Vector3d { return turn * x + Eigen::Vector3d(5, -3, 2); }},
        {"stretched",
         [](const Eigen::Vector3d& x) -> Eigen::Vector3d {
             return Eigen::Vector3d(1.3 * x[0], 0.9 * x[1], x[2]);
         }},
        {"bent",
         [](const Eigen::Vector3d& x) -> Eigen::Vector3d {
             const double angle = 0.5 * x[0];
             return Eigen::Vector3d((2 + x[2]) * std::sin(angle), x[1], (2 + x[2]) * std::cos(angle));
         }},
        {"twisted", [](const Eigen::Vector3d& x) -> Eigen::Vector3d {
             return Eigen::AngleAxisd(0.4 * x[0], Eigen::Vector3d::UnitX()) * x;
         }}};
}
std::vector<NamedPose> rough_poses() {
    const auto noise = [](double number) {
        const double n = 43758.5453 * std::sin(number);
        return n - std::floor(n) - 0.5;
    };
    return {
        {"shrunk", [](const Eigen::Vector3d& x) -> Eigen::Vector3d { return 0.5 * x; }},
        {"jittered",
         [=](const Eigen::Vector3d& x) -> Eigen::Vector3d {
             const double at = 12.9898 * x[0] + 78.233 * x[1] + 37.719 * x[2];
             return x + 0.12 * Eigen::Vector3d(noise(at), noise(at + 1), noise(at + 2));
         }},
        {"folded",
         [](const Eigen::Vector3d& x) -> Eigen::Vector3d {
             return Eigen::Vector3d(std::abs(x[0]), x[1], x[2]);
         }},
        {"flat", [](const Eigen::Vector3d& x) -> Eigen::Vector3d { return Eigen::Vector3d(x[0], x[1], 0); }},
        {"point", [](const Eigen::Vector3d&) -> Eigen::Vector3d { return Eigen::Vector3d::Zero(); }},
        {"wavy",
         [](const Eigen::Vector3d& x) -> Eigen::Vector3d {
             return Eigen::Vector3d(x[0], x[1] + 0.05 * std::sin(40 * x[0]),
                                    x[2] + 0.05 * std::sin(50 * x[1]));
         }},
        {"wound", [](const Eigen::Vector3d& x) -> Eigen::Vector3d {
             const double angle = 12 * x[0];
             return Eigen::Vector3d((0.1 + x[2]) * std::sin(angle), x[1], (0.1 + x[2]) * std::cos(angle));
         }}};
}

/// A surface with what is known of it at rest.
struct Body {
    explicit Body(const Surface& surface)
        : X(surface.X), F(surface.F), tree(shared_exact_tree(X, F)), posed(tree, BoundKind::boxes) {
        edge = (X.row(F(0, 0)) - X.row(F(0, 1))).norm();
        left_out = near_at_rest(X, F, static_cast<float>(1.5 * edge));
        const WideTree& wide = *posed.box_tree();
        rest = std::make_shared<const RestNeighbours>(X.cast<double>(), F, wide, left_out,
                                                      1.5 * edge * (1 - 1e-5), 4 * edge);
    }
    Nodes pose(const Deformation& deform) const {
        Nodes x(X.rows(), 3);
        for (Eigen::Index v = 0; v < x.rows(); ++v) x.row(v) = deform(X.row(v).transpose().cast<double>());
        return x;
    }
    bool needs_proof(int a, int b) const {
        for (const int v : F.row(a))
            for (const int w : F.row(b))
                if (v == w) return false;
        return !left_out->contains(a, b);
    }

    Vertices X;
    Faces F;
    std::shared_ptr<const CollisionTree> tree;
    PosedTree posed;
    double edge = 0;
    std::shared_ptr<const FacePairSet> left_out;
    std::shared_ptr<const RestNeighbours> rest;
};

std::vector<Body> bodies() {
    std::vector<Body> all;
    all.emplace_back(shapes::torus(36, 24));
    all.emplace_back(shapes::sphere(20, 32));
    return all;
}

/// How far faces that are proved apart are beyond what was proved, at least, metres.
double least_margin(const Body& body, const NeighbourProof& proof, const Nodes& x, const Nodes& motion,
                    const NeighbourProof::Reach& reach) {
    const WideTree& tree = proof.tree();
    const Vertices positions = x.cast<float>();
    double least = std::numeric_limits<double>::infinity();
    const auto check = [&](int a, int b) {
        double moved = 0;
        for (const int v : body.F.row(a))
            for (const int w : body.F.row(b)) moved = std::max(moved, (motion.row(v) - motion.row(w)).norm());
        const double distance = triangle_distance(test::face_triangle(positions, body.F, a),
                                                  test::face_triangle(positions, body.F, b));
        least = std::min(
            {least, distance - reach.inside, distance - reach.apart - std::min(reach.approach, moved)});
    };
    for (int leaf = 0; leaf < tree.leaves(); ++leaf)
        for (int other = 0; other < tree.leaves(); ++other) {
            const unsigned apart = proof.apart(leaf, other);
            for (int j = 0; apart >> j; ++j)
                for (int i = 0; apart >> j & 1 && i < tree.faces_in[leaf]; ++i) {
                    const int a = tree.faces[tree_width * leaf + i], b = tree.faces[tree_width * other + j];
                    if (body.needs_proof(a, b)) check(a, b);
                }
        }
    return least;
}

TEST(NeighbourProof, HoldsInEveryPose) {
    const float rounding = 1e-5f;  // of positions in single precision, up to ten metres from the origin
    for (Body& body : bodies()) {
        const Nodes motion = body.pose([](const Eigen::Vector3d& x) -> Eigen::Vector3d {
            return 0.02 * Eigen::Vector3d(std::sin(5 * x[1]), x[0] * x[2], std::cos(4 * x[0]));
        });
        const auto poses = [&] {
            std::vector<NamedPose> all = gentle_poses();
            for (const NamedPose& pose : rough_poses()) all.push_back(pose);
            return all;
        }();
        int refused = 0;
        for (const NamedPose& pose : poses)
            for (const double share : {0.0, 0.3, 0.6}) {
                SCOPED_TRACE(pose.name);
                const NeighbourProof::Reach reach{.apart = share * body.edge,
                                                  .approach = 0.5 * share * body.edge,
                                                  .inside = 0.2 * body.edge};
                NeighbourProof proof(body.rest);
                const Nodes x = body.pose(pose.deform);
                proof.prove(x, motion, reach);
                EXPECT_GT(least_margin(body, proof, x, motion, reach), -rounding);
                refused += proof.proved() < proof.leaves();
            }
        EXPECT_GT(refused, 8);
    }
}

TEST(NeighbourProof, SucceedsInGentlePosesAndNotInRoughOnes) {
    for (Body& body : bodies()) {
        NeighbourProof proof(body.rest);
        const NeighbourProof::Reach reach{.apart = 0.5 * body.edge};
        const int leaves = proof.leaves();
        for (const NamedPose& pose : gentle_poses()) {
            proof.prove(body.pose(pose.deform), {}, reach);
            EXPECT_GT(proof.proved(), 0.9 * leaves) << pose.name;
        }
        for (const NamedPose& pose : rough_poses()) {
            proof.prove(body.pose(pose.deform), {}, reach);
            EXPECT_LT(proof.proved(), leaves) << pose.name;
        }
    }
}

TEST(NeighbourProof, LeavesOutOfAQueryOnlyWhatIsFartherApart) {
    for (Body& body : bodies()) {
        NeighbourProof proof(body.rest);
        long skipped = 0;
        for (const auto& poses : {gentle_poses(), rough_poses()})
            for (const NamedPose& pose : poses) {
                SCOPED_TRACE(pose.name);
                const Nodes x = body.pose(pose.deform);
                const Vertices positions = x.cast<float>();
                const auto distance = static_cast<float>(0.5 * body.edge);
                proof.prove(positions.cast<double>(), {}, {.apart = distance});
                body.posed.begin_pose(positions);
                SelfQuery query(body.left_out);
                const auto list = [](std::span<const FacePair> pairs) {
                    return std::vector<FacePair>(pairs.begin(), pairs.end());
                };
                const auto touching = list(query.intersecting(body.posed)),
                           near = list(query.within(body.posed, distance));
                query.use(&proof);
                EXPECT_EQ(list(query.intersecting(body.posed)), touching);
                EXPECT_EQ(list(query.within(body.posed, distance)), near);
                skipped += query.counters().leaf_pairs_proved;
                query.within(body.posed, 1.01f * distance);
                EXPECT_EQ(query.counters().leaf_pairs_proved, 0) << "farther than was proved";
            }
        EXPECT_GT(skipped, 100);
    }
}

/// Where pairs reach farther than a leaf's region, the query leaves out the faces of each leaf that the
/// other's proof covers.
TEST(NeighbourProof, LeavesOutOfAQueryWhatEachLeafCovers) {
    for (Body& body : bodies()) {
        NeighbourProof proof(body.rest);
        proof.prove(body.X.cast<double>(), {}, {});
        ASSERT_EQ(proof.proved(), proof.leaves());
        const WideTree& tree = proof.tree();
        std::vector<int> slot_of(body.F.rows());
        for (int leaf = 0; leaf < tree.leaves(); ++leaf)
            for (int i = 0; i < tree.faces_in[leaf]; ++i) {
                const int slot = tree_width * leaf + i;
                slot_of[tree.faces[slot]] = slot;
            }
        const auto covers = [&](int slot, int other) {
            return proof.apart(slot / tree_width, other / tree_width) >> other % tree_width & 1;
        };
        body.posed.begin_pose(body.X);
        SelfQuery query(body.left_out);
        const auto distance = static_cast<float>(6 * body.edge);
        const auto near = [&] {
            const LeafReach everywhere = [&](int, int) { return distance; };
            const auto pairs = query.boxes_within(body.posed, distance, &everywhere);
            return std::vector<FacePair>(pairs.begin(), pairs.end());
        };
        std::vector<FacePair> expected = near();
        const std::size_t all = expected.size();
        std::erase_if(expected, [&](const FacePair& pair) {
            const int a = slot_of[pair.a], b = slot_of[pair.b];
            return covers(a, b) || covers(b, a);
        });
        query.use(&proof);
        EXPECT_EQ(near(), expected);
        EXPECT_GT(expected.size(), all / 10);
        EXPECT_LT(expected.size(), all);
    }
}

TEST(NeighbourProof, IsRefusedWherePositionsAreNotFinite) {
    const Body body(shapes::sphere(24, 40));
    NeighbourProof proof(body.rest);
    Nodes x = body.X.cast<double>();
    proof.prove(x, {}, {});
    const int all = proof.proved();
    x(100, 1) = std::numeric_limits<double>::quiet_NaN();
    proof.prove(x, {}, {});
    EXPECT_LT(proof.proved(), all);
    x.setConstant(std::numeric_limits<double>::infinity());
    proof.prove(x, {}, {});
    EXPECT_EQ(proof.proved(), 0);
}

TEST(NeighbourProof, TakesMotionThatIsNotFiniteForTheLargestApproach) {
    const Body body(shapes::sphere(24, 40));
    NeighbourProof proof(body.rest);
    const Nodes x = body.X.cast<double>();
    Nodes motion = Nodes::Zero(x.rows(), 3);
    proof.prove(x, motion, {.apart = 0.1 * body.edge, .approach = 1});
    EXPECT_EQ(proof.proved(), proof.leaves());
    for (const double number :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        motion.setConstant(number);
        proof.prove(x, motion, {.apart = 0.1 * body.edge, .approach = 1});
        EXPECT_EQ(proof.proved(), 0);
    }
}

/// A self-intersecting pose that a proof of the rest pose knows nothing of.
TEST(NeighbourProof, IsIgnoredByQueriesThatItIsNotOf) {
    Body body(shapes::torus(36, 24));
    NeighbourProof proof(body.rest);
    proof.prove(body.X.cast<double>(), {}, {.apart = 0.1 * body.edge});
    ASSERT_EQ(proof.proved(), proof.leaves());
    SelfQuery query(body.left_out);
    const Vertices flat = body.pose(rough_poses()[3].deform).cast<float>();
    body.posed.begin_step(body.X, flat);
    const std::size_t expected = query.boxes_within(body.posed, 0).size();
    query.use(&proof);
    EXPECT_EQ(query.boxes_within(body.posed, 0).size(), expected) << "in a step";
    PosedTree other(shared_exact_tree(body.X, body.F), BoundKind::boxes);
    other.begin_pose(flat);
    query.use(nullptr);
    const std::size_t touching = query.intersecting(other).size();
    EXPECT_GT(touching, 100u);
    query.use(&proof);
    EXPECT_EQ(query.intersecting(other).size(), touching) << "another tree";
}

TEST(NeighbourProof, MustLeaveOutWhatTheQueryLeavesOut) {
    const Body body(shapes::sphere(24, 40));
    const NeighbourProof proof(body.rest);
    SelfQuery all;
    EXPECT_THROW(all.use(&proof), std::invalid_argument);
    EXPECT_NO_THROW(all.use(nullptr));
}

TEST(NeighbourProof, RefusesOtherNumbersOfVertices) {
    const Body body(shapes::sphere(24, 40));
    NeighbourProof proof(body.rest);
    const Nodes x = body.X.cast<double>(), fewer = x.topRows(x.rows() - 1);
    EXPECT_THROW(proof.prove(fewer, {}, {}), std::invalid_argument);
    EXPECT_THROW(proof.prove(x, fewer, {}), std::invalid_argument);
    const auto stops = [](int, const std::function<void(int)>& task) {
        task(0);
        throw std::runtime_error("stopped");
    };
    proof.prove(x, {}, {});
    EXPECT_GT(proof.proved(), 0);
    EXPECT_THROW(proof.prove(fewer, {}, {}), std::invalid_argument);
    EXPECT_EQ(proof.proved(), 0) << "that of the pose before";
    EXPECT_THROW(proof.prove(x, {}, {}, stops), std::runtime_error);
    EXPECT_EQ(proof.proved(), 0) << "of a part of the leaves";
}

TEST(NeighbourProof, DoesNotDependOnTheExecutor) {
    const Surface surface = shapes::torus(36, 24);
    const Body body(surface);
    const Executor backwards = [](int count, const std::function<void(int)>& task) {
        for (int i = count; i-- > 0;) task(i);
    };
    const auto rest = std::make_shared<const RestNeighbours>(body.X.cast<double>(), body.F, body.rest->tree(),
                                                             body.left_out, 1.5 * body.edge * (1 - 1e-5),
                                                             4 * body.edge, backwards);
    NeighbourProof one(body.rest), other(rest);
    const Nodes x = body.pose(rough_poses().back().deform);
    one.prove(x, x, {.apart = 0.1 * body.edge});
    other.prove(x, x, {.apart = 0.1 * body.edge}, backwards);
    EXPECT_EQ(one.proved(), other.proved());
    for (int leaf = 0; leaf < one.tree().leaves(); ++leaf)
        for (int near = 0; near < one.tree().leaves(); ++near)
            ASSERT_EQ(one.apart(leaf, near), other.apart(leaf, near));
}

TEST(RestNeighbours, RefusesWhatIsNotOfTheSurface) {
    const Body body(shapes::sphere(24, 40));
    const Nodes X = body.X.cast<double>();
    const WideTree& tree = body.rest->tree();
    const Surface other = shapes::torus(24, 20);
    EXPECT_THROW(RestNeighbours(other.X.cast<double>(), other.F, tree, nullptr, 0, 0.1),
                 std::invalid_argument);
    const auto pairs = std::make_shared<const FacePairSet>(std::vector<FacePair>{}, 7);
    EXPECT_THROW(RestNeighbours(X, body.F, tree, pairs, 0, 0.1), std::invalid_argument);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double number : {-1.0, nan, std::numeric_limits<double>::infinity()}) {
        EXPECT_THROW(RestNeighbours(X, body.F, tree, nullptr, number, 0.1), std::invalid_argument);
        EXPECT_THROW(RestNeighbours(X, body.F, tree, nullptr, 0, number), std::invalid_argument);
    }
    Nodes broken = X;
    broken(3, 2) = nan;
    EXPECT_THROW(RestNeighbours(broken, body.F, tree, nullptr, 0, 0.1), std::invalid_argument);
}

TEST(RestNeighbours, CoversTheFacesAroundALeaf) {
    const Body body(shapes::torus(36, 24));
    const WideTree& tree = body.rest->tree();
    for (int leaf = 0; leaf < tree.leaves(); ++leaf) {
        if (tree.faces_in[leaf] == 0) continue;
        const RestNeighbours::Region region = body.rest->region(leaf);
        EXPECT_EQ(body.rest->covered(leaf, leaf), (1u << tree.faces_in[leaf]) - 1);
        EXPECT_GT(region.covered.size(), 4u);
        EXPECT_GE(region.distance, 0.999 * 1.5 * body.edge);
    }
}

}  // namespace
}  // namespace nbd

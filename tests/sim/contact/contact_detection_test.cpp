#include "sim/contact/contact_detection.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "collision/base/counter_random.hpp"
#include "meshing/body/make_body.hpp"
#include "sim/contact/rest_gaps.hpp"
#include "sim/obstacles/obstacle.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

/// Two boxes far from the origin, one above the other, whose surfaces are finer than their tetrahedra, so
/// that vertices hang on several nodes.
class FarBoxes : public testing::Test {
 protected:
    FarBoxes() {
        CollisionTree tree = make_exact_tree(body_.surface.X.cast<float>(), body_.surface.F);
        hang_on_nodes(tree, body_.W.cast<float>(), body_.tets.X.cast<float>());
        tree_ = std::make_shared<const CollisionTree>(std::move(tree));
    }

    struct Found {
        std::vector<Contact> contacts;
        int computed = 0;            // positions of the lower box that were computed
        std::vector<FacePair> near;  // within the thickness, in the positions of the trees
    };

    /// The contacts between the boxes, which are `gap` apart and do not move.
    Found find(BoundKind kind, double gap) {
        const ElasticBody elastic(body_.tets, body_.material);
        const Eigen::Matrix3d R =
            Eigen::AngleAxisd(0.002, Eigen::Vector3d(2, 3, 1).normalized()).toRotationMatrix();
        const auto placed = [&](const Eigen::RowVector3d& centre) {
            const Nodes x = (body_.tets.X.rowwise() + centre) * R.transpose();
            return BodyState{x.rowwise() + Eigen::RowVector3d(20000, -15000, 18000),
                             Nodes::Zero(x.rows(), 3)};
        };
        const BodyState states[] = {placed({0, 0, 0}), placed({0.03, 0.01, 0.3 + gap})};
        std::vector<ContactSurface> surfaces;
        std::vector<PosedTree> trees;
        Vertices nodes[2];
        for (std::size_t b = 0; b < 2; ++b) {
            nodes[b] = states[b].x.cast<float>();
            trees.emplace_back(tree_, kind);
            surfaces.emplace_back(std::make_shared<const ContactShape>(body_.W, body_.surface.F, body_.tets.X,
                                                                       trees[b].box_tree()),
                                  states[b].x);
        }
        std::vector<ContactParty> parties;
        for (std::size_t b = 0; b < 2; ++b) {
            if (kind == BoundKind::affine)
                trees[b].begin_pose_of_nodes(nodes[b]);
            else
                trees[b].begin_pose(surfaces[b].x_float());
            parties.push_back({elastic, states[b], surfaces[b], elastic.material().young, &trees[b]});
        }
        StepReport report;
        ContactDetection detection;
        detection.find(parties, {}, {}, thickness, 0, 0, 5e-3, report);
        const int computed = surfaces[0].computed();
        PairQuery query;
        const auto found = query.boxes_within(trees[0], trees[1], static_cast<float>(thickness));
        std::vector<FacePair> near(found.begin(), found.end());
        std::ranges::sort(near);
        return {{detection.contacts().begin(), detection.contacts().end()}, computed, near};
    }

    static constexpr double thickness = 0.01;

 private:
    Body body_ = test::fine_box_body({1, 0.4, 0.3}, {3, 2, 2}, 2);
    std::shared_ptr<const CollisionTree> tree_;
};

TEST_F(FarBoxes, HaveTheContactsOfExactBoundsWithAffineOnes) {
    CounterRandom random(7, 0);
    int with_contacts = 0, left_out = 0;
    for (int i = 0; i < 40; ++i) {
        const double gap = thickness * (1 + 0.3 * (random.unit() - 0.7));
        const Found exact = find(BoundKind::exact, gap), affine = find(BoundKind::affine, gap);
        with_contacts += !exact.contacts.empty();
        left_out += !std::ranges::includes(affine.near, exact.near);
        ASSERT_EQ(affine.contacts.size(), exact.contacts.size()) << gap;
        for (std::size_t c = 0; c < exact.contacts.size(); ++c) {
            EXPECT_EQ(affine.contacts[c].a.vertices, exact.contacts[c].a.vertices);
            EXPECT_EQ(affine.contacts[c].b.vertices, exact.contacts[c].b.vertices);
            EXPECT_EQ(affine.contacts[c].gap, exact.contacts[c].gap);
        }
    }
    EXPECT_GT(with_contacts, 5);
    EXPECT_GT(left_out, 5) << "at the thickness itself, positions in single precision leave out pairs";
}

TEST_F(FarBoxes, HaveNoPositionsComputedWhereNothingMayTouch) {
    const Found apart = find(BoundKind::affine, 40 * thickness), touching = find(BoundKind::affine, 0);
    EXPECT_EQ(apart.computed, 0);
    EXPECT_TRUE(apart.contacts.empty());
    EXPECT_GT(touching.computed, 50);
    EXPECT_LT(touching.computed, find(BoundKind::exact, 0).computed);
    EXPECT_FALSE(touching.contacts.empty());
}

/// Signed distance to the box [-h, h].
double box_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& h) {
    const Eigen::Vector3d q = p.cwiseAbs() - h;
    return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

TEST(Obstacle, GivesDistancesToPlanesAndSpheres) {
    const Obstacle plane{.shape = PlaneShape{.point = {0, 0, 1}, .normal = Eigen::Vector3d::UnitZ()}};
    const auto above = signed_distance(plane, {3, -2, 1.5}, 0, 1);
    ASSERT_TRUE(above);
    EXPECT_DOUBLE_EQ(above->distance, 0.5);
    EXPECT_DOUBLE_EQ(signed_distance(plane, {3, -2, 0}, 0, 1)->distance, -1);
    const Obstacle ball{.shape = BallShape{.centre = {1, 0, 0}, .radius = 0.5}, .velocity = {0, 2, 0}};
    const auto beside = signed_distance(ball, {1, 1 + 3, 0}, 1.0, 10);  // the centre has moved to (1, 2, 0)
    ASSERT_TRUE(beside);
    EXPECT_NEAR(beside->distance, 1.5, 1e-12);
    EXPECT_LT((beside->normal - Eigen::Vector3d::UnitY()).norm(), 1e-12);
    EXPECT_NEAR(signed_distance(ball, {1, 2, 0}, 1.0, 10)->distance, -0.5, 1e-12);
}

TEST(Obstacle, MeshDistancesAgreeWithTheBoxThatTheMeshDescribes) {
    const Eigen::Vector3d half(0.5, 0.2, 0.15);
    const Body box = test::box_body(2 * half, {5, 2, 3});
    const Obstacle obstacle{.shape = std::make_shared<const StaticSurface>(box.surface)};
    CounterRandom random(5, 0);
    int inside = 0;
    for (int i = 0; i < 2000; ++i) {
        const Eigen::Vector3d p(random.uniform(-0.8, 0.8), random.uniform(-0.4, 0.4),
                                random.uniform(-0.3, 0.3));
        const auto hit = signed_distance(obstacle, p, 0, 10);
        ASSERT_TRUE(hit);
        ASSERT_NEAR(hit->distance, box_distance(p, half), 1e-12) << p.transpose();
        EXPECT_NEAR(hit->normal.norm(), 1, 1e-12);
        // A walk along the normal reaches the surface.
        EXPECT_NEAR(box_distance(p - hit->distance * hit->normal, half), 0, 1e-12);
        if (hit->distance < 0) ++inside;
    }
    EXPECT_GT(inside, 200);
    EXPECT_LT(inside, 1500);
    EXPECT_FALSE(signed_distance(obstacle, {5, 0, 0}, 0, 1));
}

TEST(Obstacle, RejectsInvalidMeshes) {
    const auto message = [](const TriMesh& mesh) { return test::refusal([&] { StaticSurface{mesh}; }); };
    TriMesh mesh = test::box_body({1, 1, 1}, {1, 1, 1}).surface;
    EXPECT_EQ(message(mesh), "");
    EXPECT_EQ(message({}), "static surface: it has no faces");
    TriMesh open = mesh;
    open.F.conservativeResize(open.F.rows() - 1, 3);
    EXPECT_EQ(message(open).rfind("static surface: it is open at edge ", 0), 0u) << message(open);
    TriMesh wild = mesh;
    wild.F(3, 1) = 99;
    EXPECT_EQ(message(wild), "surface: face 3 refers to vertex 99, but there are 8");
    TriMesh infinite = mesh;
    infinite.X(2, 0) = std::numeric_limits<double>::infinity();
    EXPECT_EQ(message(infinite), "static surface: a vertex is not finite");
}

/// A bar of 3 m with a slot from one end, 2 m deep, between walls 1/3 m apart, stretched along z.
TriMesh fork(double stretch) {
    const TetMesh bar = test::box_mesh({3, 1, 1}, {9, 3, 3});
    std::vector<int> kept;
    for (int t = 0; t < bar.T.rows(); ++t) {
        const Eigen::RowVector3d centroid = bar.X(bar.T.row(t), Eigen::all).colwise().mean();
        if (centroid[0] < 1 || centroid[2] < 1.0 / 3 || centroid[2] > 2.0 / 3) kept.push_back(t);
    }
    std::vector<int> number(bar.X.rows(), -1), used;
    Tets T = bar.T(kept, Eigen::all);
    for (int& node : T.reshaped()) {
        int& name = number[node];
        if (name < 0) {
            name = used.size();
            used.push_back(node);
        }
        node = name;
    }
    TriMesh mesh = make_body("fork", {bar.X(used, Eigen::all), T}).surface;
    mesh.X.col(2) *= stretch;
    return mesh;
}

TEST(RestGaps, AreFoundWhereWallsOfASlotAreNear) {
    const RestGaps wide = rest_gaps(fork(1), 0.35);
    EXPECT_GT(wide.pairs, 0);
    EXPECT_NEAR(wide.least, 1.0 / 3, 1e-6);
    EXPECT_EQ(rest_gaps(fork(1), 0.3).pairs, 0);
    const RestGaps narrow = rest_gaps(fork(0.01), 0.35);
    EXPECT_NEAR(narrow.least, 0.01 / 3, 1e-6);
    EXPECT_GE(narrow.pairs, wide.pairs);
}

/// At the bottom of the slot its walls are joined by an edge or two.
TEST(RestGaps, AreNotThoseNearAlongTheSurface) { EXPECT_EQ(rest_gaps(fork(1), 2.1).pairs, 0); }

TEST(RestGaps, AreNotBetweenTheSidesOfAThinPart) {
    const TriMesh plate = test::box_body({1, 1, 0.01}, {4, 4, 1}).surface;
    EXPECT_EQ(rest_gaps(plate, 0.05).pairs, 0);
}

TEST(RestGaps, DoNotDependOnThePlace) {
    TriMesh far = fork(0.01);
    far.X.rowwise() += Eigen::RowVector3d(5e5, 5e6, 0);
    const RestGaps here = rest_gaps(fork(0.01), 0.35), there = rest_gaps(far, 0.35);
    EXPECT_EQ(there.pairs, here.pairs);
    EXPECT_NEAR(there.least, here.least, 1e-6);
}

}  // namespace
}  // namespace nbd

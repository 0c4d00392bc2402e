#include "sim/contact/contact_detection.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <vector>

#include "collision/base/counter_random.hpp"
#include "meshing/body/make_body.hpp"
#include "tests/support/box_body.hpp"

namespace nbd {
namespace {

/// Two boxes far from the origin, one above the other, whose surfaces are finer than their tetrahedra, so
/// that vertices hang on several nodes.
class FarBoxes : public testing::Test {
 protected:
    FarBoxes() : body_(test::box_body({1, 0.4, 0.3}, {3, 2, 2})) {
        const Subdivision fine = subdivide(body_.surface, SubdivisionScheme::midpoint, 2);
        body_.W = (fine.S * body_.W).eval();
        body_.surface = fine.mesh;
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
    Body body_;
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

}  // namespace
}  // namespace nbd

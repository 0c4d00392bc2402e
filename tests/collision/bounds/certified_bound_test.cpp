#include "collision/bounds/certified/certified_bound.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>

#include "collision/bounds/certified/build_certified_model.hpp"
#include "collision/bounds/certified/solid_meter.hpp"
#include "collision/geometry/bounding_sphere.hpp"
#include "collision/tree/posed_tree.hpp"
#include "tests/support/shapes.hpp"
#include "tests/support/solid_bodies.hpp"

namespace nbd {
namespace {

using test::SolidBody;

/// A body with its tree, its model and the meter of its region motions.
struct Certified {
    SolidBody body;
    SphereTree tree;
    CertifiedModel model;
    SolidMeter meter;

    Certified(SolidBody b, const CertifiedConfig& config = {}, int depth = 6)
        : body(std::move(b)),
          tree(build_sphere_tree(body.X, body.F, {.depth = depth, .min_leaf_faces = 2})),
          model(build_certified_model(tree, body.F, body.solid, body.W, config)),
          meter(body.solid, std::make_shared<const TetRegions>(model.regions)) {
        check_certified_model(model, tree, static_cast<int>(body.X.rows()));
    }
};

/// Statistics of a bound over many poses, checked in double precision against the vertices.
struct Count {
    long bounds = 0, misses = 0;
    double inflation = 0;  // sum of r / r_exact - 1
};

Count judge(Certified& c, CertifiedBound& bound, const Vertices& nodes) {
    const Vertices x = c.body.surface(nodes);
    bound.begin_pose(x, c.meter.measure(nodes));
    Count count;
    for (int i = 0; i < static_cast<int>(c.tree.nodes.size()); ++i) {
        const Sphere s = bound.bound(i), exact = bounding_sphere(x, c.tree.node_vertices(i));
        double farthest = 0;
        for (const int v : c.tree.node_vertices(i))
            farthest = std::max(farthest, (x.row(v).transpose().cast<double>() - s.c.cast<double>()).norm());
        ++count.bounds;
        count.misses += !(farthest <= double{s.r});
        count.inflation += double{s.r} / double{exact.r} - 1;
    }
    return count;
}

/// Covers poses from gentle to extreme and surfaces that equal the tetrahedra's boundary, refine it, smooth
/// it, or lie partly outside it at random.
TEST(CertifiedBound, NeverMissesInAMillionNodePoses) {
    long bounds = 0, misses = 0, wide = 0;
    for (const auto& body : test::solid_bodies())
        for (const int anchors : {3, 16}) {
            Certified c(body, {.anchors = anchors});
            CertifiedBound bound(c.tree, c.model);
            for (int i = 0; i < test::pose_kinds * 90; ++i) {
                const Count count = judge(c, bound, test::solid_pose(c.body, i));
                bounds += count.bounds;
                misses += count.misses;
                wide += count.inflation > 1e-3 * static_cast<double>(count.bounds);
            }
        }
    EXPECT_GE(bounds, 1'000'000);
    EXPECT_GT(wide, 100);  // many poses are not trivially exact
    EXPECT_EQ(misses, 0);
}

TEST(CertifiedBound, IsNearlyExactUnderRigidAndAffineMotion) {
    Certified c(test::solid_box());
    CertifiedBound bound(c.tree, c.model);
    std::mt19937 random(3);
    for (int i = 0; i < 20; ++i) {
        Vertices nodes = c.body.solid.X.cast<float>();
        if (i % 2) {
            const Eigen::Matrix3f A = Eigen::Matrix3f::Identity() + 0.3f * Eigen::Matrix3f::Random();
            nodes = (nodes * A.transpose()).eval();
        }
        const Count count = judge(c, bound, shapes::moved(nodes, shapes::random_motion(random, 1)));
        EXPECT_EQ(count.misses, 0);
        EXPECT_LT(count.inflation / static_cast<double>(count.bounds), 0.03);
    }
}

TEST(CertifiedBound, GivesEachDisconnectedPartAnAnchor) {
    for (const double spread : {0., 4.}) {
        Certified c(test::solid_pair(), {.anchors = 1, .spread = spread});
        EXPECT_EQ(c.model.cell_begin[1], 2);
        CertifiedBound bound(c.tree, c.model);
        for (int i = 0; i < test::pose_kinds; ++i)
            EXPECT_EQ(judge(c, bound, test::solid_pose(c.body, i)).misses, 0);
    }
}

TEST(CertifiedBound, HoldsWhereOnlyStretchesAreGiven) {
    Certified c(test::solid_box());
    CertifiedBound bound(c.tree, c.model);
    for (int i = 0; i < test::pose_kinds; ++i) {
        const Vertices nodes = test::solid_pose(c.body, i), x = c.body.surface(nodes);
        std::vector<RegionMotion> stretches;
        for (const RegionMotion& m : c.meter.measure(nodes))
            stretches.push_back({.deviation = m.stretch, .stretch = m.stretch});
        bound.begin_pose(x, stretches);
        for (int node = 0; node < static_cast<int>(c.tree.nodes.size()); ++node) {
            const Sphere s = bound.bound(node);
            for (const int v : c.tree.node_vertices(node))
                ASSERT_LE((x.row(v).transpose().cast<double>() - s.c.cast<double>()).norm(), double{s.r});
        }
    }
}

TEST(CertifiedBound, MissesWhenPathLengthsAreUnderstated) {
    Certified c(test::solid_box(), {.anchors = 3});
    for (CertifiedModel::Cell& cell : c.model.cells) {
        cell.path *= 0.5f;
        cell.m *= 0.5f;
        cell.B *= 0.5f;
    }
    for (CertifiedModel::Leg& leg : c.model.legs) leg.length *= 0.5f;
    CertifiedBound bound(c.tree, c.model);
    long misses = 0;
    for (int i = 0; i < test::pose_kinds; ++i) misses += judge(c, bound, test::solid_pose(c.body, i)).misses;
    EXPECT_GT(misses, 0);  // proves that the tests above can fail
}

TEST(CertifiedBound, IsTheExactSphereWithoutRegionMotions) {
    Certified c(test::solid_box());
    CertifiedBound bound(c.tree, c.model);
    const Vertices x = c.body.surface(test::solid_pose(c.body, 3));
    bound.begin_pose(x);
    for (int i = 0; i < static_cast<int>(c.tree.nodes.size()); ++i) {
        const Sphere s = bound.bound(i), exact = bounding_sphere(x, c.tree.node_vertices(i));
        EXPECT_EQ(s.c, exact.c);
        EXPECT_EQ(s.r, exact.r);
    }
}

TEST(CertifiedBound, HasAnInfiniteRadiusWhereAGradientIsNotFinite) {
    Certified c(test::solid_box());
    const Vertices nodes = test::solid_pose(c.body, 1), x = c.body.surface(nodes);
    const std::span<const RegionMotion> measured = c.meter.measure(nodes);
    std::vector<RegionMotion> motion(measured.begin(), measured.end());
    for (RegionMotion& m : motion) m.deviation = m.stretch = std::numeric_limits<float>::infinity();
    CertifiedBound bound(c.tree, c.model);
    bound.begin_pose(x, motion);
    const Sphere root = bound.bound(0);
    EXPECT_TRUE(root.c.allFinite());
    EXPECT_EQ(root.r, std::numeric_limits<float>::infinity());
}

TEST(CertifiedModel, BuildRejectsInvalidInput) {
    const SolidBody box = test::solid_box();
    const SphereTree tree = build_sphere_tree(box.X, box.F);
    const auto refused = [&](const CertifiedConfig& config, const TetMesh& solid) {
        EXPECT_THROW(build_certified_model(tree, box.F, solid, box.W, config), std::invalid_argument);
    };
    refused({.anchors = 0}, box.solid);
    refused({.spread = -1}, box.solid);
    refused({.regions = {.splits = 9}}, box.solid);
    refused({.regions = {.samples = 0}}, box.solid);
    TetMesh bad = box.solid;
    bad.T(4, 2) = static_cast<int>(bad.X.rows());
    refused({}, bad);
    bad = box.solid;
    std::swap(bad.T(4, 2), bad.T(4, 3));
    refused({}, bad);
    bad = box.solid;
    bad.X.conservativeResize(bad.X.rows() + 1, 3);
    bad.X.bottomRows<1>().setZero();
    refused({}, bad);
}

TEST(CertifiedModel, CheckReportsEachKindOfInvalidModel) {
    const Certified c(test::solid_box());
    const auto refused = [&](const auto& damage) {
        CertifiedModel model = c.model;
        damage(model);
        EXPECT_THROW(check_certified_model(model, c.tree, static_cast<int>(c.body.X.rows())),
                     std::invalid_argument);
    };
    refused([](CertifiedModel& m) { m.cell_begin.pop_back(); });
    refused([](CertifiedModel& m) { m.cell_begin[1] = m.cell_begin[0]; });
    refused([](CertifiedModel& m) { m.cells[3].anchor = 1'000'000; });
    refused([](CertifiedModel& m) { m.cells[3].carrier = -1; });
    refused([](CertifiedModel& m) { m.cells[3].leg_end = 1'000'000; });
    refused([](CertifiedModel& m) { m.cells[3].path = -1; });
    refused([](CertifiedModel& m) { m.legs[0].length = -1; });
    refused([](CertifiedModel& m) { m.cells[3].weight = 0; });
    refused([](CertifiedModel& m) { m.cells[3].B(1, 1) = std::nanf(""); });
    refused([](CertifiedModel& m) { m.pairs[0].other = m.regions.count(); });
    refused([](CertifiedModel& m) { m.legs[0].pair = -1; });
    refused([](CertifiedModel& m) { m.regions.of_tet[0] = -1; });
    refused([](CertifiedModel& m) { m.regions.samples[0] = 1'000'000; });
    refused([](CertifiedModel& m) { m.rounding = -1; });
}

}  // namespace
}  // namespace nbd

#include "sim/barrier/barrier.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "sim/barrier/edge_mollifier.hpp"
#include "sim/contact/barrier_law.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

constexpr BarrierLaw law{.reach = 0.02, .floor = 0.002, .stiffness = 300};

TEST(BarrierLaw, HasTheDerivativesThatItStates) {
    for (double d = 0.003; d < law.reach; d += 0.001) {
        const double h = 1e-7;
        const auto at = law.at(d), less = law.at(d - h), more = law.at(d + h);
        EXPECT_NEAR(at.slope, (more.energy - less.energy) / (2 * h), 1e-6 * std::abs(at.slope) + 1e-9) << d;
        EXPECT_NEAR(at.curvature, (more.slope - less.slope) / (2 * h), 1e-6 * at.curvature + 1e-6) << d;
        EXPECT_LT(at.slope, 0) << d;
        EXPECT_GT(at.curvature, 0) << d;
    }
}

TEST(BarrierLaw, BeginsSmoothlyAtItsReach) {
    EXPECT_EQ(law.at(law.reach).energy, 0);
    EXPECT_EQ(law.at(1).slope, 0);
    const auto near = law.at(law.reach - 1e-9);
    EXPECT_LT(near.energy, 1e-20);
    EXPECT_LT(std::abs(near.slope), 1e-11);
    EXPECT_LT(near.curvature, 1e-3);
}

TEST(BarrierLaw, IsInfiniteAtItsFloor) {
    EXPECT_GT(law.at(law.floor * (1 + 1e-9)).energy, 1);
    EXPECT_TRUE(std::isinf(law.at(law.floor).energy));
    EXPECT_TRUE(std::isinf(law.at(0).energy));
}

TEST(BarrierLaw, GoesOnAlongItsTangentBelowADistance) {
    BarrierLaw linear = law;
    linear.linear_below = 0.005;
    const auto edge = law.at(linear.linear_below);
    for (const double d : {0.005, 0.004, 0.0, -1.0}) {
        const auto at = linear.at(d);
        EXPECT_EQ(at.curvature, edge.curvature);
        EXPECT_NEAR(at.slope, edge.slope + (d - linear.linear_below) * edge.curvature,
                    1e-12 * std::abs(at.slope));
        const double h = 1e-4;
        EXPECT_NEAR((linear.at(d - h).energy - linear.at(d - 3 * h).energy) / (2 * h),
                    linear.at(d - 2 * h).slope, 1e-9 * std::abs(at.slope));
    }
    EXPECT_EQ(linear.at(0.006).slope, law.at(0.006).slope);
}

/// Two edges at an angle, of lengths 2 and 3 at rest and a little longer now.
struct Edges {
    explicit Edges(double angle)
        : u(2.1, 0.1, 0), w(Eigen::AngleAxisd(angle, Eigen::Vector3d(0, 1, 2).normalized()) * (1.6 * u)) {}
    double weight() const { return edge_mollifier(u, w, 4, 9); }
    Eigen::Vector3d u, w;
};

TEST(EdgeMollifier, FallsToZeroWhereEdgesBecomeParallel) {
    EXPECT_NEAR(Edges(0).weight(), 0, 1e-12);
    EXPECT_EQ(Edges(0.1).weight(), 1);
    double last = 0, most = 0;
    for (double angle = 0; angle < 0.04; angle += 1e-4) {
        const double weight = Edges(angle).weight();
        EXPECT_GE(weight, last);
        most = std::max(most, weight - last);
        last = weight;
    }
    EXPECT_EQ(last, 1);
    EXPECT_LT(most, 0.01);
}

constexpr double reach = 0.05;

/// The derivative of the energy by the share of the motion, from the contacts.
double slope(Barrier& barrier, double share) {
    double sum = 0;
    for (const Contact& c : barrier.contacts(share)) {
        Eigen::Vector3d motion = -0.01 * c.wall_velocity;
        const auto add = [&](const SurfacePoint& point, double sign) {
            for (std::size_t k = 0; k < static_cast<std::size_t>(point.count); ++k) {
                const MovingSurface& s = barrier.surfaces()[point.body];
                const Eigen::Vector3d step = s.end(point.vertices[k]) - s.begin(point.vertices[k]);
                motion += sign * point.weights[k] * step;
            }
        };
        add(c.a, 1);
        add(c.b, -1);
        sum += c.barrier.at(c.gap).slope * c.normal.dot(motion);
    }
    return sum;
}

/// Two boxes above a moving plane, beside a ball and a mesh.
class BarrierTest : public ::testing::Test {
 protected:
    BarrierTest() : barrier_({}, reach) {
        const auto shape = std::make_shared<const ContactShape>(box_.W, box_.surface.F, box_.tets.X);
        for (int b = 0; b < 2; ++b) barrier_.add_body(shape, box_.tets, 1e5);
        barrier_.add_obstacle({.shape = PlaneShape{.point = {0, 0, -0.53}}, .motion = travel({0, 0, 1})});
        barrier_.add_obstacle({.shape = BallShape{.centre = {-0.9, 0, 0}, .radius = 0.375}});
        TriMesh wall = box_.surface;
        wall.X.col(1).array() += 1.04;
        barrier_.add_obstacle({.shape = std::make_shared<const StaticSurface>(wall)});
        barrier_.begin();
        begin_ = {box_.tets.X, box_.tets.X.rowwise() + Eigen::RowVector3d(1.03, 0.1, 0.05)};
        end_ = begin_;
        for (std::size_t b = 0; b < 2; ++b) end_[b] += test::wild_field(box_.tets.X, 0.02);
    }
    double move() {
        barrier_.begin_step(0, 0.01);
        return barrier_.move(begin_, end_, 0);
    }

    Body box_ = test::box_body({1, 1, 1}, {3, 3, 3});
    Barrier barrier_;
    std::vector<Nodes> begin_, end_;
};

TEST_F(BarrierTest, ContactsAreTheGradientOfItsEnergyAtTheBegin) {
    constexpr double h = 1e-6;
    ASSERT_GT(move(), 0.01);
    const double measured =
        (-3 * barrier_.energy(0) + 4 * barrier_.energy(h) - barrier_.energy(2 * h)) / (2 * h);
    int pressing = 0, walls = 0;
    for (const Contact& c : barrier_.contacts(0)) {
        EXPECT_LE(c.barrier.linear_below, c.gap);
        if (!(c.gap < reach)) continue;
        ++pressing;
        walls += c.b.body < 0;
    }
    EXPECT_GT(pressing, 20);
    EXPECT_GT(walls, 5);
    EXPECT_LT(walls, pressing);
    EXPECT_GT(std::abs(measured), 1e-3);
    EXPECT_NEAR(slope(barrier_, 0), measured, 1e-4 * std::abs(measured));
}

TEST_F(BarrierTest, NamesContactsThatTheRestOfTheMotionMakes) {
    begin_[0].rowwise() += Eigen::RowVector3d(0, 0, 5 * reach);
    begin_[1].rowwise() += Eigen::RowVector3d(0, 0, 9);
    end_ = begin_;
    const auto on_plane = [&] {
        barrier_.begin_step(0, 0);
        barrier_.move(begin_, end_, 0);
        std::size_t count = 0;
        for (const Contact& c : barrier_.contacts(0)) count += c.obstacle == 0;
        return count;
    };
    EXPECT_EQ(on_plane(), 0);
    end_[0].rowwise() -= Eigen::RowVector3d(0, 0, 5 * reach);
    EXPECT_EQ(on_plane(), 16);
}

/// Two boxes with an edge of each along x, one above the other, of which one tilts and turns through the
/// position in which the edges are parallel, at half of the motion.
TEST(BarrierOfParallelEdges, ForcesDoNotJumpAsTheyTurn) {
    const Body box = test::box_body({1, 1, 1}, {1, 1, 1});
    const auto shape = std::make_shared<const ContactShape>(box.W, box.surface.F, box.tets.X);
    Barrier barrier({}, reach);
    for (int b = 0; b < 2; ++b) barrier.add_body(shape, box.tets, 1e5);
    barrier.begin();
    const Eigen::Matrix3d on_edge = Eigen::AngleAxisd(std::atan(1.0), Eigen::Vector3d::UnitX()).matrix();
    const auto lower = [&](double angle) {
        const Eigen::AngleAxisd turn(angle, Eigen::Vector3d(0, 1, 0.7).normalized());
        return Nodes(box.tets.X * (turn * on_edge).transpose());
    };
    const double gap = 0.6 * reach;
    const Nodes upper =
        (box.tets.X * on_edge.transpose()).rowwise() + Eigen::RowVector3d(0.3, 0, std::sqrt(2.0) + gap);
    barrier.begin_step(0, 0.01);
    ASSERT_EQ(
        barrier.move(std::vector<Nodes>{lower(-0.01), upper}, std::vector<Nodes>{lower(0.01), upper}, 0), 1);
    double largest = 0, jump = 0;
    std::optional<double> last;
    for (int k = -400; k <= 400; ++k) {
        const double stated = slope(barrier, 0.5 + 1e-3 * k + 1e-7);
        largest = std::max(largest, std::abs(stated));
        if (last) jump = std::max(jump, std::abs(stated - *last));
        last = stated;
    }
    EXPECT_GT(largest, 0);
    EXPECT_LT(jump, 0.1 * largest);  // from one of the 801 shares to the next
}

TEST_F(BarrierTest, AllowsNoMotionThatEndsInACollision) {
    end_[0].rowwise() += Eigen::RowVector3d(0.5, 0.4, -0.3);
    const double limit = move();
    EXPECT_GT(limit, 0);
    EXPECT_LT(limit, 0.5);
    EXPECT_TRUE(std::isfinite(barrier_.energy(limit)));
    for (Nodes* nodes : {&end_[0], &end_[1]}) {
        const std::size_t b = nodes == end_.data() ? 0 : 1;
        *nodes = begin_[b] + limit * (end_[b] - begin_[b]);
    }
    EXPECT_TRUE(barrier_.intersections(end_).empty());
    barrier_.move(end_, end_, limit);
    EXPECT_LT(barrier_.energy(0), 1e300);
    EXPECT_LT(barrier_.least_distance(), reach);
}

TEST_F(BarrierTest, LetsFreeMotionPass) {
    begin_[1].rowwise() += Eigen::RowVector3d(0, 0, 3);
    begin_[0].rowwise() += Eigen::RowVector3d(0, 0, 6);
    end_ = begin_;
    end_[0].rowwise() += Eigen::RowVector3d(1, 2, 3);
    EXPECT_EQ(move(), 1);
    EXPECT_EQ(barrier_.energy(1), 0);
    EXPECT_TRUE(barrier_.contacts(1).empty());
    EXPECT_TRUE(std::isinf(barrier_.least_distance()));
}

}  // namespace
}  // namespace nbd

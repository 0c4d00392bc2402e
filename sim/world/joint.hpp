#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "sim/contact/bond.hpp"
#include "sim/fem/elastic_body.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/keyed.hpp"

namespace nbd {

/// Holds two bodies together at a point.
struct BallJoint {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
};

/// What a hinge or slider lets happen along its one freedom: an angle in radians, or a way in metres, that is
/// zero when the joint is added.
struct JointFreedom {
    Keyed<double> motor{};  // the value that it is brought to; none: it moves freely
    std::optional<double> least{}, most{};
    double stiffness = 0, rest = 0;  // of a spring, N m or N/m, and its value at rest
    double damping = 0;              // N m s or N s/m
};

/// Turns about an axis. The angle is one within -pi and pi: it comes round again. Limits: both or none,
/// within 150 degrees.
struct HingeJoint {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    JointFreedom angle{};  // of the first body against the second
};

/// Moves along an axis, without turning.
struct SliderJoint {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    JointFreedom way{};
};

/// Holds two bodies together at these places.
struct WeldJoint {
    Nodes places;  // [k, 3] metres
};

/// A spring or a rope between a point of each, or what pulls these together by a force that is given. Only
/// that may join two points of one body.
struct CordJoint {
    Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
    double stiffness = 0;            // N/m; 0: it does not stretch
    double damping = 0;              // N s/m
    std::optional<double> length{};  // at rest, metres; none: that when it is added
    Keyed<double> winch{};           // likewise by keyframes, > 0; none: it stays
    bool pulls_only = false;         // as a rope does
    Keyed<double> tension{};         // newtons, >= 0, at any length; none: as stiffness and length say
};

/// A joint between two bodies, or a body and the world. Places are those in the world when it is added.
struct Joint {
    std::string name{};
    int a = 0, b = -1;  // bodies; -1: the world
    std::variant<BallJoint, HingeJoint, SliderJoint, WeldJoint, CordJoint> kind{};
    // Metres, of what holds a hinge or slider against turning; 0: a tenth of the smaller body, or half the
    // way from a hinge to rigid bodies.
    double width = 0;
    double strength = std::numeric_limits<double>::infinity();  // force at which it breaks for good, newtons
    // Whether the two touch, also once it is broken; ropes and springs do not keep them from it.
    bool bodies_meet = false;
};

/// Throws std::invalid_argument, naming the first number that is out of range.
void check_joint(const Joint& joint, int body_count);

/// Forces and torques, about its centre of mass, of a joint on each of its bodies.
struct JointLoad {
    Momentum on_a{}, on_b{};  // N and N m; or their impulses
};

/// How stiffly a body holds each of its nodes where the others stay: its mass, kg, and its stiffness, N/m.
struct NodeHold {
    Eigen::VectorXd mass, stiffness;  // [N]
    bool is_rigid = false;
};
NodeHold node_hold(const ElasticBody& body);

/// The bonds of a joint. They are stiffer than the elements about them, so that a joint gives by no more than
/// a hundredth of what these do; between two rigid bodies as stiff as these.
class JointBonds {
 public:
    /// x: positions of the nodes of all bodies, now. holds: of all bodies, and sizes, metres. Throws
    /// std::invalid_argument where a place lies too far outside of a body that deforms, see embed().
    JointBonds(Joint joint, int number, std::span<const ElasticBody* const> bodies, std::span<const Nodes> x,
               std::span<const std::shared_ptr<const NodeHold>> holds, std::span<const double> sizes);

    const Joint& joint() const noexcept { return joint_; }
    /// What brings it to values that are told: the motor of a hinge or slider, the tension of a cord; null:
    /// none.
    Keyed<double>* told() noexcept;

    /// By how much its points may be apart, metres: a hundredth of the smaller body, and a twentieth of the
    /// width of what holds a hinge or slider, which is 3 degrees. Beyond, its motion is not that of a joint.
    double most_give() const noexcept { return std::min(size_ / 100, width_ / 20); }

    /// Adds the bonds for a step of length dt that ends at `time`, linearised where the nodes are at x.
    /// Bond::difference is that at x.
    void add(std::span<const Nodes> x, double time, double dt, std::vector<Bond>& bonds) const;

    /// The largest distance of a place of the joint, where it was added, from a point, metres; of a cord no
    /// less than its length.
    double reach_from(const Eigen::Vector3d& point) const;

    /// Of a cord that does not stretch, N/m, in steps of length dt.
    double firmness(double dt) const;

    /// From the end of a cord to its begin at x, metres.
    Eigen::Vector3d span(std::span<const Nodes> x) const;

    /// The angle of a hinge, the way of a slider or the length of a cord at x; 0 of others.
    double value(std::span<const Nodes> x) const;

 private:
    /// A point with the frame of a hinge or slider: the axis and two directions across, all of one length.
    struct Frame {
        CarriedPoint origin;
        std::array<CarriedPoint, 3> tips;
        Eigen::Vector3d at{0, 0, 0};                  // of the world
        std::array<Eigen::Vector3d, 3> directions{};  // of the world, unit
    };
    struct Place {
        CarriedPoint point;
        Eigen::Vector3d position;
    };
    /// The axis and the directions across, as body b has them at x.
    std::array<Eigen::Vector3d, 3> directions(std::span<const Nodes> x) const;
    /// The place of body b with these coordinates in its frame, metres.
    Place in_frame(const Eigen::Vector3d& coordinates, std::span<const Nodes> x) const;
    double stiffness(const CarriedPoint& a, const CarriedPoint& b, double dt) const;
    void bind(const CarriedPoint& a, const Place& b, BondLaw law, std::span<const Nodes> x,
              std::vector<Bond>& bonds) const;
    void bind_spring(const CarriedPoint& a, const Place& b, const BondLaw& law, std::span<const Nodes> x,
                     std::vector<Bond>& bonds) const;
    void add_freedom(const JointFreedom& freedom, double value, double arm, const CarriedPoint& a,
                     std::span<const Nodes> x, double time, double dt, std::vector<Bond>& bonds) const;

    Joint joint_;
    int number_;
    double size_;  // of the smaller of its bodies, metres
    double width_ = 0;
    std::vector<CarriedPoint> on_a_, on_b_;  // points that hold each other; of b none where it is the world
    std::vector<Eigen::Vector3d> in_world_;  // instead
    Frame frame_;                            // of b
    double length_ = 0;                      // of a cord
    std::array<std::shared_ptr<const NodeHold>, 2> holds_;
};

}  // namespace nbd

#include "sim/world/joint.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "meshing/body/embed.hpp"
#include "meshing/body/rigid_body.hpp"
#include "sim/fem/momentum.hpp"

namespace nbd {
namespace {

constexpr double stiffer = 100;                              // bonds than elements
constexpr double most_angle = 150 * std::numbers::pi / 180;  // of a limit: beyond, angles come round again

Eigen::Vector3d position(const CarriedPoint& point, std::span<const Nodes> x) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < point.nodes.size(); ++k)
        sum += point.weights[k] * x[point.body].row(point.nodes[k]).transpose();
    return sum;
}

/// Points that a body carries, at places in the world. A rigid body carries any.
std::vector<CarriedPoint> carried_at(int body, const ElasticBody& elastic, const Nodes& x,
                                     const Nodes& places) {
    TetMesh now = elastic.rest();
    now.X = x;
    std::vector<CarriedPoint> points;
    if (is_rigid(now)) {
        Eigen::Matrix4d corners;
        const Eigen::RowVector3d middle = x.colwise().mean();
        const double size = 2 * (x.rowwise() - middle).rowwise().norm().maxCoeff();
        for (int a = 0; a < 4; ++a) corners.col(a) << x.row(a).transpose(), 1;
        for (Eigen::Index p = 0; p < places.rows(); ++p) {
            const Eigen::Vector4d z =
                corners.partialPivLu().solve(Eigen::Vector4d(places(p, 0), places(p, 1), places(p, 2), 1));
            constexpr double farthest = 1000;
            if (!((places.row(p) - middle).norm() <= farthest * size) || !z.allFinite())
                throw std::invalid_argument(fmt::format(
                    "a place at ({:.6g}, {:.6g}, {:.6g}) is farther from its rigid body than {} times "
                    "its size",
                    places(p, 0), places(p, 1), places(p, 2), farthest));
            points.push_back({body, {0, 1, 2, 3}, {z[0], z[1], z[2], z[3]}});
        }
        return points;
    }
    const Embedding W = embed(now, places);
    for (Eigen::Index p = 0; p < W.rows(); ++p) {
        CarriedPoint& point = points.emplace_back(CarriedPoint{body, {}, {}});
        for (Embedding::InnerIterator entry(W, p); entry; ++entry) {
            point.nodes.push_back(entry.col());
            point.weights.push_back(entry.value());
        }
    }
    return points;
}

/// The point origin + sum c_k (tips_k - origin).
CarriedPoint combined(const CarriedPoint& origin, const std::array<CarriedPoint, 3>& tips,
                      const Eigen::Vector3d& c) {
    CarriedPoint point{origin.body, {}, {}};
    const auto add = [&](const CarriedPoint& from, double factor) {
        for (std::size_t k = 0; k < from.nodes.size() && factor != 0; ++k) {
            const auto known = std::ranges::find(point.nodes, from.nodes[k]);
            if (known == point.nodes.end()) {
                point.nodes.push_back(from.nodes[k]);
                point.weights.push_back(factor * from.weights[k]);
            } else {
                point.weights[known - point.nodes.begin()] += factor * from.weights[k];
            }
        }
    };
    add(origin, 1 - c.sum());
    for (int k = 0; k < 3; ++k) add(tips[k], c[k]);
    return point;
}

/// The stiffness by which a body holds a point against a force on it, N/m.
double held_stiffness(const CarriedPoint& point, const NodeHold& hold, double dt) {
    double weighted = 0, squared = 0;
    for (std::size_t k = 0; k < point.nodes.size(); ++k) {
        const double w = point.weights[k] * point.weights[k];
        const int node = point.nodes[k];
        weighted += w * (hold.mass[node] / (dt * dt) + hold.stiffness[node]);
        squared += w;
    }
    return weighted / (squared * squared);
}

std::array<Eigen::Vector3d, 3> axes_along(const Eigen::Vector3d& axis) {
    const Eigen::Vector3d n = axis.normalized(), across = n.unitOrthogonal();
    return {n, across, n.cross(across)};
}

void check_finite(const Joint& joint, const Eigen::Vector3d& v, const char* what) {
    if (!v.allFinite())
        throw std::invalid_argument(fmt::format("joint \"{}\": its {} is not finite", joint.name, what));
}

/// what: of the joint; not_negative: whether its values must be >= 0.
void check_keyed(const Joint& joint, const Keyed<double>& keyed, const char* what, bool not_negative) {
    const auto fail = [&](const std::string& problem) {
        throw std::invalid_argument(fmt::format("joint \"{}\": {}", joint.name, problem));
    };
    if (keyed.times.size() != keyed.values.size())
        fail(fmt::format("its {} needs a value for each time", what));
    for (std::size_t k = 0; k < keyed.times.size(); ++k) {
        const double value = keyed.values[k];
        if (!std::isfinite(keyed.times[k]) || !std::isfinite(value) || (not_negative && value < 0))
            fail(fmt::format("its {} needs finite numbers{}", what, not_negative ? " >= 0" : ""));
        if (k > 0 && !(keyed.times[k] > keyed.times[k - 1]))
            fail(fmt::format("the times of its {} must ascend", what));
    }
}

void check_freedom(const Joint& joint, const JointFreedom& freedom, double farthest) {
    const auto fail = [&](const std::string& what) {
        throw std::invalid_argument(fmt::format("joint \"{}\": {}", joint.name, what));
    };
    check_keyed(joint, freedom.motor, "motor", false);
    for (const auto& limit : {freedom.least, freedom.most})
        if (limit && !(std::abs(*limit) <= farthest))
            fail(fmt::format("a limit is {}, but must lie within {} and {}", *limit, -farthest, farthest));
    const bool is_angle = std::isfinite(farthest);
    if (is_angle && freedom.least.has_value() != freedom.most.has_value())
        fail("a hinge needs both limits or none, as angles come round again");
    if (is_angle && !(std::abs(freedom.rest) < std::numbers::pi))
        fail(fmt::format("the angle at rest is {:.6g} degrees, but must lie within -180 and 180",
                         freedom.rest * 180 / std::numbers::pi));
    if (freedom.least && freedom.most && !(*freedom.least < *freedom.most))
        fail("its least value must be below its most");
    if (!freedom.motor.empty() &&
        (freedom.least || freedom.most || freedom.stiffness > 0 || freedom.damping > 0))
        fail("a motor leaves nothing to limits, a spring or a damper; name one of them");
    if (!(freedom.stiffness >= 0) || !(freedom.damping >= 0) || !std::isfinite(freedom.stiffness) ||
        !std::isfinite(freedom.damping) || !std::isfinite(freedom.rest))
        fail("its spring needs a stiffness and damping >= 0");
    for (const auto& [limit, sign] : {std::pair(freedom.least, 1.0), std::pair(freedom.most, -1.0)})
        if (limit && sign * *limit > 0) fail("it starts at 0, which its limits must allow");
}

void check_pull(const Joint& joint, const CordJoint& cord) {
    if (cord.stiffness > 0 || cord.damping > 0 || cord.pulls_only || cord.length || !cord.winch.empty())
        throw std::invalid_argument(fmt::format(
            "joint \"{}\": a tension that is given leaves nothing to stiffness, damping and length; "
            "name one of them",
            joint.name));
    check_keyed(joint, cord.tension, "tension", true);
}

}  // namespace

void check_joint(const Joint& joint, int body_count) {
    const auto fail = [&](const std::string& what) {
        throw std::invalid_argument(fmt::format("joint \"{}\": {}", joint.name, what));
    };
    if (joint.a < 0 || joint.a >= body_count || joint.b < -1 || joint.b >= body_count)
        fail(fmt::format("body {} is not in 0..{}", joint.a < 0 || joint.a >= body_count ? joint.a : joint.b,
                         body_count - 1));
    const auto* cord = std::get_if<CordJoint>(&joint.kind);
    const bool is_pull = cord && !cord->tension.empty();
    if (joint.a == joint.b && !is_pull) fail("joins a body to itself");
    if (!(joint.strength > 0)) fail(fmt::format("its strength is {} N, but must be > 0", joint.strength));
    if (!(joint.width >= 0) || !std::isfinite(joint.width))
        fail(fmt::format("its width is {} m, but must be >= 0", joint.width));
    const auto check_axis = [&](const Eigen::Vector3d& axis) {
        check_finite(joint, axis, "axis");
        if (!(axis.norm() > 0)) fail("its axis must not be zero");
    };
    if (const auto* ball = std::get_if<BallJoint>(&joint.kind)) check_finite(joint, ball->point, "point");
    if (const auto* hinge = std::get_if<HingeJoint>(&joint.kind)) {
        check_finite(joint, hinge->point, "point");
        check_axis(hinge->axis);
        check_freedom(joint, hinge->angle, most_angle);
    }
    if (const auto* slider = std::get_if<SliderJoint>(&joint.kind)) {
        check_finite(joint, slider->point, "point");
        check_axis(slider->axis);
        check_freedom(joint, slider->way, std::numeric_limits<double>::infinity());
    }
    if (const auto* weld = std::get_if<WeldJoint>(&joint.kind)) {
        if (weld->places.rows() == 0) fail("it welds no places");
        if (!weld->places.allFinite()) fail("a place is not finite");
    }
    if (cord) {
        check_finite(joint, cord->from, "first end");
        check_finite(joint, cord->to, "second end");
        if (!(cord->stiffness >= 0) || !std::isfinite(cord->stiffness) || !(cord->damping >= 0) ||
            !std::isfinite(cord->damping))
            fail("it needs a stiffness and damping >= 0");
        const double length = cord->length.value_or((cord->from - cord->to).norm());
        if (!(length > 0) || !std::isfinite(length))
            fail(fmt::format("its length is {} m, but must be > 0", length));
        if (is_pull) check_pull(joint, *cord);
        check_keyed(joint, cord->winch, "winch", true);
        if (!cord->winch.empty() && cord->length) fail("a winch leaves nothing to its length");
        if (std::ranges::any_of(cord->winch.values, [](double value) { return !(value > 0); }))
            fail("the lengths of its winch must be > 0");
    }
}

NodeHold node_hold(const ElasticBody& body) {
    const SparseMatrix K = body.rest_stiffness();
    const Eigen::VectorXd diagonal = K.diagonal();
    NodeHold hold{.mass = body.node_masses(),
                  .stiffness = Eigen::VectorXd(body.node_count()),
                  .is_rigid = body.is_rigid()};
    for (int i = 0; i < body.node_count(); ++i) hold.stiffness[i] = diagonal.segment<3>(3 * i).mean();
    return hold;
}

namespace {

/// A tenth of the smaller body, or half the way from a hinge's axis to rigid bodies, which it may hold
/// anywhere: a spring that turns a body far away would bend what holds it on a short width. But no more than
/// ten times the size of the smaller one, or its way: what is small and near beside that would be held
/// loosely. sizes: [bodies] metres.
double usual_width(const Joint& joint, std::span<const ElasticBody* const> bodies, std::span<const Nodes> x,
                   std::span<const double> sizes) {
    const double tenth =
        std::min(sizes[joint.a], joint.b < 0 ? std::numeric_limits<double>::infinity() : sizes[joint.b]) / 10;
    const auto* hinge = std::get_if<HingeJoint>(&joint.kind);
    if (!hinge) return tenth;
    double arm = 0, least = std::numeric_limits<double>::infinity();
    for (const int body : {joint.a, joint.b}) {
        if (body < 0) continue;
        if (!bodies[body]->is_rigid()) return tenth;
        const Eigen::Vector3d way = centre_of_mass(*bodies[body], x[body]) - hinge->point;
        const double away = way.cross(hinge->axis.normalized()).norm();
        arm = std::max(arm, away);
        least = std::min(least, std::max(sizes[body], away));
    }
    return std::max(tenth, std::min(arm / 2, 10 * least));
}

}  // namespace

JointBonds::JointBonds(Joint joint, int number, std::span<const ElasticBody* const> bodies,
                       std::span<const Nodes> x, std::span<const std::shared_ptr<const NodeHold>> holds,
                       std::span<const double> sizes)
    : joint_(std::move(joint)), number_(number), size_(sizes[joint_.a]) {
    if (joint_.b >= 0) size_ = std::min(size_, sizes[joint_.b]);
    width_ = joint_.width > 0 ? joint_.width : usual_width(joint_, bodies, x, sizes);
    holds_[0] = holds[joint_.a];
    if (joint_.b >= 0) holds_[1] = holds[joint_.b];
    const auto on = [&](int body, const Nodes& places) {
        try {
            return carried_at(body, *bodies[body], x[body], places);
        } catch (const std::invalid_argument& error) {
            throw std::invalid_argument(
                fmt::format("joint \"{}\", body {}: {}", joint_.name, body, error.what()));
        }
    };
    const auto hold = [&](const Nodes& of_a, const Nodes& of_b) {
        on_a_ = on(joint_.a, of_a);
        if (joint_.b >= 0)
            on_b_ = on(joint_.b, of_b);
        else
            for (Eigen::Index p = 0; p < of_b.rows(); ++p) in_world_.push_back(of_b.row(p).transpose());
    };
    const auto with_frame = [&](const Eigen::Vector3d& point, const Eigen::Vector3d& axis, bool along) {
        const std::array<Eigen::Vector3d, 3> e = axes_along(axis);
        // A hinge is held at both sides of its point.
        Nodes places(4, 3);
        const Eigen::Vector3d begin = along ? point : Eigen::Vector3d(point - width_ / 2 * e[0]);
        places.row(0) = begin;
        for (int k = 0; k < 3; ++k) places.row(1 + k) = begin + width_ * e[k];
        hold(places, places);
        frame_ = {.origin = {}, .tips = {}, .at = begin, .directions = e};
        if (joint_.b < 0) return;
        frame_.origin = on_b_[0];
        for (int k = 0; k < 3; ++k) frame_.tips[k] = on_b_[1 + k];
    };
    if (const auto* ball = std::get_if<BallJoint>(&joint_.kind))
        hold(ball->point.transpose(), ball->point.transpose());
    if (const auto* hinge = std::get_if<HingeJoint>(&joint_.kind))
        with_frame(hinge->point, hinge->axis, false);
    if (const auto* slider = std::get_if<SliderJoint>(&joint_.kind))
        with_frame(slider->point, slider->axis, true);
    if (const auto* weld = std::get_if<WeldJoint>(&joint_.kind)) hold(weld->places, weld->places);
    if (const auto* cord = std::get_if<CordJoint>(&joint_.kind)) {
        hold(cord->from.transpose(), cord->to.transpose());
        length_ = cord->length.value_or((cord->from - cord->to).norm());
    }
}

Keyed<double>* JointBonds::told() noexcept {
    Keyed<double>* told = nullptr;
    if (auto* hinge = std::get_if<HingeJoint>(&joint_.kind)) told = &hinge->angle.motor;
    if (auto* slider = std::get_if<SliderJoint>(&joint_.kind)) told = &slider->way.motor;
    if (auto* cord = std::get_if<CordJoint>(&joint_.kind))
        told = cord->winch.empty() ? &cord->tension : &cord->winch;
    return told && !told->empty() ? told : nullptr;
}

std::array<Eigen::Vector3d, 3> JointBonds::directions(std::span<const Nodes> x) const {
    if (joint_.b < 0) return frame_.directions;
    const Eigen::Vector3d origin = position(frame_.origin, x);
    std::array<Eigen::Vector3d, 3> e;
    e[0] = (position(frame_.tips[0], x) - origin).normalized();
    const Eigen::Vector3d across = position(frame_.tips[1], x) - origin;
    e[1] = (across - e[0].dot(across) * e[0]).normalized();
    e[2] = e[0].cross(e[1]);
    return e;
}

JointBonds::Place JointBonds::in_frame(const Eigen::Vector3d& c, std::span<const Nodes> x) const {
    if (joint_.b >= 0) {
        CarriedPoint point = combined(frame_.origin, frame_.tips, c / width_);
        const Eigen::Vector3d at = position(point, x);
        return {std::move(point), at};
    }
    Eigen::Vector3d at = frame_.at;
    for (int k = 0; k < 3; ++k) at += c[k] * frame_.directions[k];
    return {{}, at};
}

double JointBonds::stiffness(const CarriedPoint& a, const CarriedPoint& b, double dt) const {
    double least = std::numeric_limits<double>::infinity();
    bool is_rigid = true;
    for (const auto& [point, hold] : {std::pair(&a, holds_[0].get()), std::pair(&b, holds_[1].get())}) {
        if (point->body < 0) continue;
        least = std::min(least, held_stiffness(*point, *hold, dt));
        is_rigid = is_rigid && hold->is_rigid;
    }
    return (is_rigid ? 1 : stiffer) * least;
}

void JointBonds::bind(const CarriedPoint& a, const Place& b, BondLaw law, std::span<const Nodes> x,
                      std::vector<Bond>& bonds) const {
    bonds.push_back({.a = a,
                     .b = b.point,
                     .law = std::move(law),
                     .difference = position(a, x) - b.position,
                     .joint = number_});
}

/// A spring, and a damper of its own: what that did before a step is no guide to what it does in it.
void JointBonds::bind_spring(const CarriedPoint& a, const Place& b, const BondLaw& law,
                             std::span<const Nodes> x, std::vector<Bond>& bonds) const {
    BondLaw spring = law, damper = law;
    spring.damping = 0;
    damper.stiffness = 0;
    if (spring.stiffness > 0) {
        bind(a, b, spring, x, bonds);
        bonds.back().is_spring = true;
    }
    if (damper.damping > 0) bind(a, b, damper, x, bonds);
}

double JointBonds::reach_from(const Eigen::Vector3d& point) const {
    const auto away = [&](const Eigen::Vector3d& place) { return (place - point).norm(); };
    if (const auto* weld = std::get_if<WeldJoint>(&joint_.kind)) {
        double reach = 0;
        for (const auto& place : weld->places.rowwise()) reach = std::max(reach, away(place.transpose()));
        return reach;
    }
    if (const auto* cord = std::get_if<CordJoint>(&joint_.kind))
        return std::max({away(cord->from), away(cord->to), length_});
    if (const auto* hinge = std::get_if<HingeJoint>(&joint_.kind)) return away(hinge->point);
    if (const auto* slider = std::get_if<SliderJoint>(&joint_.kind)) return away(slider->point);
    return away(std::get<BallJoint>(joint_.kind).point);
}

Eigen::Vector3d JointBonds::span(std::span<const Nodes> x) const {
    return position(on_a_[0], x) - (joint_.b < 0 ? in_world_[0] : position(on_b_[0], x));
}

double JointBonds::value(std::span<const Nodes> x) const {
    if (std::holds_alternative<SliderJoint>(joint_.kind)) {
        const Eigen::Vector3d way = position(on_a_[0], x) - in_frame({0, 0, 0}, x).position;
        return directions(x)[0].dot(way);
    }
    if (std::holds_alternative<CordJoint>(joint_.kind)) return span(x).norm();
    if (!std::holds_alternative<HingeJoint>(joint_.kind)) return 0;
    const std::array<Eigen::Vector3d, 3> e = directions(x);
    const Eigen::Vector3d arm = position(on_a_[2], x) - position(on_a_[0], x);
    return std::atan2(e[2].dot(arm), e[1].dot(arm));
}

double JointBonds::firmness(double dt) const {
    return stiffness(on_a_[0], joint_.b < 0 ? CarriedPoint{} : on_b_[0], dt);
}

/// What a motor, limits or a spring do along the freedom of a hinge or slider. a: the point of body a that
/// they act on, in a hinge `arm` from its axis; a slider has none.
void JointBonds::add_freedom(const JointFreedom& freedom, double value, double arm, const CarriedPoint& a,
                             std::span<const Nodes> x, double time, double dt,
                             std::vector<Bond>& bonds) const {
    const std::array<Eigen::Vector3d, 3> e = directions(x);
    const bool is_slider = arm == 0;
    const double unit = is_slider ? 1 : arm;  // metres of the point for a unit of the freedom
    // The place of body b where the freedom has a value, and its direction there.
    const auto at = [&](double target) {
        if (is_slider) return std::pair(in_frame({target, 0, 0}, x), e[0]);
        const double c = std::cos(target), s = std::sin(target);
        return std::pair(in_frame({0, arm * c, arm * s}, x), Eigen::Vector3d(c * e[2] - s * e[1]));
    };
    if (!freedom.motor.empty()) {
        const auto [place, along] = at(freedom.motor.at(time, 0));
        BondLaw law;
        law.K = stiffness(a, place.point, dt) * Eigen::Matrix3d::Identity();
        if (is_slider) law.K = stiffness(a, place.point, dt) * along * along.transpose();
        bind(a, place, law, x, bonds);
    }
    if (freedom.stiffness > 0 || freedom.damping > 0) {
        const auto [place, along] = at(value);
        BondLaw law;
        law.along = along;
        law.stiffness = freedom.stiffness / (unit * unit);
        const double away = freedom.rest - value;  // by the shorter way round
        law.length = unit * (is_slider ? away : std::remainder(away, 2 * std::numbers::pi));
        law.damping = freedom.damping / (unit * unit);
        bind_spring(a, place, law, x, bonds);
    }
    for (const auto& [limit, sign] : {std::pair(freedom.least, -1.0), std::pair(freedom.most, 1.0)}) {
        if (!limit) continue;
        // On the other side of the axis the direction would be the opposite one.
        if (!is_slider && !(std::abs(value - *limit) < std::numbers::pi / 2)) continue;
        const auto [place, along] = at(*limit);
        BondLaw law;
        law.along = sign * along;
        law.stiffness = stiffness(a, place.point, dt);
        law.pulls_only = true;
        bind(a, place, law, x, bonds);
    }
}

void JointBonds::add(std::span<const Nodes> x, double time, double dt, std::vector<Bond>& bonds) const {
    const auto opposite = [&](std::size_t p) -> Place {
        if (joint_.b < 0) return {{}, in_world_[p]};
        return {on_b_[p], position(on_b_[p], x)};
    };
    const auto hold = [&](const CarriedPoint& a, const Place& b, const Eigen::Matrix3d& directions) {
        BondLaw law;
        law.K = stiffness(a, b.point, dt) * directions;
        bind(a, b, law, x, bonds);
    };
    const Eigen::Matrix3d all = Eigen::Matrix3d::Identity();
    if (std::holds_alternative<BallJoint>(joint_.kind) || std::holds_alternative<WeldJoint>(joint_.kind))
        for (std::size_t p = 0; p < on_a_.size(); ++p) hold(on_a_[p], opposite(p), all);
    if (const auto* hinge = std::get_if<HingeJoint>(&joint_.kind)) {
        for (const std::size_t p : {0u, 1u}) hold(on_a_[p], opposite(p), all);
        add_freedom(hinge->angle, value(x), width_, on_a_[2], x, time, dt, bonds);
    }
    if (const auto* slider = std::get_if<SliderJoint>(&joint_.kind)) {
        const std::array<Eigen::Vector3d, 3> e = directions(x);
        const double way = value(x);
        const Eigen::Matrix3d across = all - e[0] * e[0].transpose();
        hold(on_a_[0], in_frame({way, 0, 0}, x), across);
        hold(on_a_[1], in_frame({way + width_, 0, 0}, x), across);
        hold(on_a_[2], in_frame({way, width_, 0}, x), e[2] * e[2].transpose());
        add_freedom(slider->way, way, 0, on_a_[0], x, time, dt, bonds);
    }
    if (const auto* cord = std::get_if<CordJoint>(&joint_.kind)) {
        const Place to = opposite(0);
        BondLaw law;
        if (!cord->tension.empty()) {
            law.tension = cord->tension.at(time, 0);
            bind(on_a_[0], to, law, x, bonds);
            bonds.back().is_spring = true;
            return;
        }
        law.stiffness = cord->stiffness > 0 ? cord->stiffness : stiffness(on_a_[0], to.point, dt);
        law.damping = cord->damping;
        law.length = cord->winch.at(time, length_);
        law.pulls_only = cord->pulls_only;
        if (cord->pulls_only || cord->stiffness == 0)
            bind(on_a_[0], to, law, x, bonds);
        else
            bind_spring(on_a_[0], to, law, x, bonds);
    }
}

}  // namespace nbd

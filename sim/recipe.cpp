#include "sim/recipe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "collision/counter_random.hpp"

namespace nbd {
namespace {

constexpr int kind_count = 5;
constexpr const char* kind_names[kind_count] = {"drop", "forces", "grips", "thrown", "free"};

Eigen::Vector3d random_perpendicular(CounterRandom& random, const Eigen::Vector3d& axis) {
    const Eigen::Vector3d d = random.direction();
    return (d - d.dot(axis) * axis).stableNormalized();
}

/// Draws one recipe. Members are what every ingredient needs.
class Draw {
 public:
    Draw(const Body& body, const ExcitationConfig& config, int index)
        : body_(body),
          strength_(config.strength),
          scales_(natural_scales(body)),
          random_(config.seed, static_cast<std::uint64_t>(index)) {
        recipe_.kind =
            static_cast<RecipeKind>((index + static_cast<int>(config.seed % kind_count)) % kind_count);
        recipe_.frame_interval = config.frame_interval > 0 ? config.frame_interval : scales_.time / 5;
        recipe_.rotation = random_.orientation().toRotationMatrix();
        recipe_.first_frame = random_.uniform(0.4, 0.8) * scales_.time;
        duration_ = recipe_.first_frame + recipe_.frame_interval * config.frames;
        const Eigen::RowVector3d centroid = body.tets.X.colwise().mean();
        x_ = (body.tets.X.rowwise() - centroid) * recipe_.rotation.transpose();
    }

    Recipe run() {
        switch (recipe_.kind) {
            case RecipeKind::drop:
                add_gradient(0.02, 0.08);
                add_floor();
                recipe_.velocity.z() = -random_.uniform(0.10, 0.25) * strength_ * scales_.speed;
                add_forces(0.5);
                break;
            case RecipeKind::forces:
                add_gradient(0.02, 0.10);
                add_forces(1);
                break;
            case RecipeKind::grips:
                add_gradient(0.01, 0.05);
                add_grips();
                add_forces(0.3);
                break;
            case RecipeKind::thrown:
                add_gradient(0.01, 0.05);
                if (random_.unit() < 0.5) add_floor();
                add_thrown();
                add_forces(0.2);
                break;
            case RecipeKind::free:
                add_gradient(0.2, 0.4);
                add_forces(0.6);
                break;
        }
        return recipe_;
    }

 private:
    /// Stretching, shear and spin at once; strain: of the deformation that the motion runs into.
    void add_gradient(double low, double high) {
        const double rate = random_.uniform(low, high) * strength_ * std::numbers::pi / scales_.time;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) recipe_.gradient(i, j) = random_.uniform(-1, 1);
        recipe_.gradient *= rate / recipe_.gradient.norm() * std::numbers::sqrt3;
    }

    void add_floor() {
        recipe_.floor = x_.col(2).minCoeff() - random_.uniform(0.015, 0.04) * scales_.length;
        const double sag = random_.uniform(0.02, 0.06) * strength_;
        recipe_.gravity.z() = -sag * scales_.speed * scales_.speed / scales_.length;
    }

    /// Pulls and pokes, half of them balanced by the opposite force elsewhere. share: of the usual number.
    void add_forces(double share) {
        const int most =
            static_cast<int>(std::lround(share * std::max(2.0, duration_ / (2.5 * scales_.time))));
        for (int i = 0; i < most; ++i) {
            const double start = random_.uniform(-0.5, 0.9) * duration_,
                         length = random_.uniform(1.5, 4) * scales_.time;
            PatchForce force = patch(std::max(0.0, start), length);
            recipe_.forces.push_back(force);
            if (random_.unit() < 0.5) continue;
            PatchForce other = patch(force.start, length);
            const double size = std::min(force.force.norm(), other.force.norm());
            recipe_.forces.back().force = size * force.force.stableNormalized();
            other.force = -recipe_.forces.back().force;
            recipe_.forces.push_back(other);
        }
    }

    /// Force = strain times modulus times the cross-section that the patch's volume stands for, so that a
    /// limb gets less than a trunk.
    PatchForce patch(double start, double duration) {
        PatchForce force{
            .node = random_.index(static_cast<int>(x_.rows())), .start = start, .duration = duration};
        force.radius = random_.uniform(0.12, 0.25) * scales_.length;
        double volume = 0;
        for (Eigen::Index t = 0; t < body_.tets.T.rows(); ++t) {
            const Eigen::Vector3d p[4] = {x_.row(body_.tets.T(t, 0)), x_.row(body_.tets.T(t, 1)),
                                          x_.row(body_.tets.T(t, 2)), x_.row(body_.tets.T(t, 3))};
            const Eigen::Vector3d centre = (p[0] + p[1] + p[2] + p[3]) / 4;
            if ((centre - x_.row(force.node).transpose()).norm() < force.radius)
                volume += (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]) / 6;
        }
        const double area = volume / (2 * force.radius), strain = random_.uniform(0.2, 0.6) * strength_;
        force.force = strain * body_.material.young * area * random_.direction();
        return force;
    }

    /// A random direction along which the body is long: the longest of a few random chords.
    Eigen::Vector3d long_axis() {
        Eigen::Vector3d longest = Eigen::Vector3d::Zero();
        for (int i = 0; i < 8; ++i) {
            const int a = random_.index(static_cast<int>(x_.rows())),
                      b = random_.index(static_cast<int>(x_.rows()));
            const Eigen::Vector3d chord = x_.row(a) - x_.row(b);
            if (chord.norm() > longest.norm()) longest = chord;
        }
        return longest.norm() > 0 ? longest.normalized() : random_.direction();
    }

    void add_grips() {
        const Eigen::Vector3d axis = long_axis();
        const Eigen::VectorXd along = x_ * axis;
        const double low = along.minCoeff(), span = along.maxCoeff() - low,
                     share = random_.uniform(0.10, 0.2);
        const double twist = random_.uniform(-0.9, 0.9), bend = random_.uniform(-0.5, 0.5);
        const double stretch = random_.uniform(-0.12, 0.15), shear = random_.uniform(-0.15, 0.15);
        const Eigen::Vector3d across = random_perpendicular(random_, axis);
        const double start = random_.uniform(0, 0.1) * duration_,
                     length = random_.uniform(2, 6) * scales_.time;
        const double release = random_.uniform(0.5, 1.2) * duration_;
        for (const double end : {-1.0, 1.0}) {
            Grip grip{.start = start, .duration = length, .release = release};
            for (int i = 0; i < x_.rows(); ++i) {
                const double from_end = (end < 0 ? along[i] - low : low + span - along[i]) / span;
                if (from_end <= share) grip.nodes.push_back(i);
            }
            grip.centre = x_(grip.nodes, Eigen::all).colwise().mean().transpose();
            grip.rotation = end * strength_ * (twist * axis + bend * across);
            grip.translation = end * strength_ * span * (stretch * axis + shear * across) / 2;
            recipe_.grips.push_back(grip);
        }
    }

    /// From beside, or from above where there is a floor; started where the boxes along the way just clear.
    void add_thrown() {
        ThrownCopy copy;
        copy.rotation = random_.orientation().toRotationMatrix();
        Eigen::Vector3d from = random_.direction();
        if (recipe_.floor) from = (from + 2 * Eigen::Vector3d::UnitZ()).normalized();
        const Nodes other = x_ * recipe_.rotation * copy.rotation.transpose();
        const double clearance = (x_ * from).maxCoeff() - (other * from).minCoeff() + 0.03 * scales_.length;
        const Eigen::Vector3d aside =
            random_.uniform(0, 0.2) * scales_.length * random_perpendicular(random_, from);
        copy.centre = clearance * from + aside;
        copy.velocity = -random_.uniform(0.15, 0.35) * strength_ * scales_.speed * from;
        if (recipe_.floor)  // never start below it
            copy.centre.z() =
                std::max(copy.centre.z(), *recipe_.floor - other.col(2).minCoeff() + 0.02 * scales_.length);
        recipe_.thrown = copy;
    }

    const Body& body_;
    double strength_;
    NaturalScales scales_;
    CounterRandom random_;
    Recipe recipe_;
    double duration_ = 0;  // seconds, all frames included
    Nodes x_;              // nodes at the start
};

nlohmann::ordered_json json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::ordered_json json(const Eigen::Matrix3d& m) {
    return {json(Eigen::Vector3d(m.row(0))), json(Eigen::Vector3d(m.row(1))),
            json(Eigen::Vector3d(m.row(2)))};
}

}  // namespace

NaturalScales natural_scales(const Body& body) {
    NaturalScales scales;
    scales.length = (body.tets.X.colwise().maxCoeff() - body.tets.X.colwise().minCoeff()).norm();
    scales.speed = std::sqrt(body.material.young / body.material.density);
    scales.time = scales.length / scales.speed;
    return scales;
}

void check_excitation_config(const ExcitationConfig& config) {
    const auto check = [](const char* name, double value, bool good, const char* allowed) {
        if (!good || !std::isfinite(value))
            throw std::invalid_argument(
                fmt::format("excitation: {} is {}, but must be {}", name, value, allowed));
    };
    check("frames", config.frames, config.frames > 0, "> 0");
    check("frame_interval", config.frame_interval, config.frame_interval >= 0, ">= 0");
    check("steps_per_frame", config.steps_per_frame, config.steps_per_frame > 0, "> 0");
    check("strength", config.strength, config.strength > 0, "> 0");
}

Recipe draw_recipe(const Body& body, const ExcitationConfig& config, int index) {
    check_excitation_config(config);
    if (index < 0) throw std::invalid_argument(fmt::format("excitation: trajectory {} must be >= 0", index));
    return Draw(body, config, index).run();
}

std::string recipe_json(const Recipe& recipe) {
    nlohmann::ordered_json text;
    text["kind"] = kind_names[static_cast<int>(recipe.kind)];
    text["frame_interval"] = recipe.frame_interval;
    text["first_frame"] = recipe.first_frame;
    text["rotation"] = json(recipe.rotation);
    text["velocity"] = json(recipe.velocity);
    text["velocity_gradient"] = json(recipe.gradient);
    text["gravity"] = json(recipe.gravity);
    if (recipe.floor) text["floor"] = *recipe.floor;
    for (const PatchForce& f : recipe.forces)
        text["forces"].push_back({{"node", f.node},
                                  {"radius", f.radius},
                                  {"force", json(f.force)},
                                  {"start", f.start},
                                  {"duration", f.duration}});
    for (const Grip& g : recipe.grips)
        text["grips"].push_back({{"nodes", g.nodes},
                                 {"centre", json(g.centre)},
                                 {"translation", json(g.translation)},
                                 {"rotation", json(g.rotation)},
                                 {"start", g.start},
                                 {"duration", g.duration},
                                 {"release", g.release}});
    if (recipe.thrown)
        text["thrown"] = {{"rotation", json(recipe.thrown->rotation)},
                          {"centre", json(recipe.thrown->centre)},
                          {"velocity", json(recipe.thrown->velocity)}};
    return text.dump();
}

}  // namespace nbd

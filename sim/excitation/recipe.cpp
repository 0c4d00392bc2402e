#include "sim/excitation/recipe.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace nbd {

LocalThickness::LocalThickness(const TetMesh& tets) {
    const auto node = [&](int i) { return Eigen::Vector3d(tets.X.row(i)); };
    for (Eigen::Index t = 0; t < tets.T.rows(); ++t) {
        const Eigen::Vector3d a = node(tets.T(t, 0)), b = node(tets.T(t, 1)), c = node(tets.T(t, 2)),
                              d = node(tets.T(t, 3));
        tets_.push_back({(a + b + c + d) / 4, (b - a).cross(c - a).dot(d - a) / 6 * tets.filled(t)});
    }
    const Faces faces = boundary_faces(tets);
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
        const Eigen::Vector3d a = node(faces(f, 0)), b = node(faces(f, 1)), c = node(faces(f, 2));
        faces_.push_back({(a + b + c) / 3, (b - a).cross(c - a).norm() / 2});
    }
}

double LocalThickness::sum(const std::vector<Piece>& pieces, const Eigen::Vector3d& point, double radius) {
    double total = 0;
    for (const Piece& piece : pieces)
        if ((piece.centroid - point).squaredNorm() < radius * radius) total += piece.measure;
    return total;
}

double LocalThickness::at(const Eigen::Vector3d& point, double radius) const {
    const double area = sum(faces_, point, radius);
    return area > 0 ? 4 * volume(point, radius) / area : std::numeric_limits<double>::infinity();
}

double LocalThickness::volume(const Eigen::Vector3d& point, double radius) const {
    return sum(tets_, point, radius);
}

NaturalScales natural_scales(const Body& body, const LocalThickness& thickness) {
    NaturalScales scales;
    const Nodes& X = body.tets.X;
    scales.length = (X.colwise().maxCoeff() - X.colwise().minCoeff()).norm();
    const Material material = mean_material(body);
    scales.young = material.young;
    scales.speed = std::sqrt(scales.young / material.density);
    scales.time = scales.length / scales.speed;

    // Samples the thickness in balls that hold several elements and at most a limb.
    constexpr double everywhere = std::numeric_limits<double>::infinity();
    const double element = std::cbrt(thickness.volume(Eigen::Vector3d::Zero(), everywhere) /
                                     static_cast<double>(body.tets.T.rows()));  // about half an edge
    const double radius = std::max(0.06 * scales.length, 4 * element);
    const Eigen::Index samples = std::min<Eigen::Index>(X.rows(), 200);
    std::vector<double> thin;
    for (Eigen::Index i = 0; i < samples; ++i)
        if (const double d = thickness.at(X.row(i * X.rows() / samples), radius); d > 0) thin.push_back(d);
    if (thin.empty()) return scales;
    constexpr double least_sturdiness = 0.02;
    const auto quarter = thin.begin() + thin.size() / 4;
    std::ranges::nth_element(thin, quarter);
    scales.sturdiness = std::clamp(*quarter / (stocky * scales.length), least_sturdiness, 1.0);
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
    check("strength", config.ranges.strength, config.ranges.strength > 0, "> 0");
    recipe_mix(config.ranges);
}

void check_duration(const ExcitationConfig& config, const NaturalScales& scales) {
    const double longest = max_duration * scales.time;
    const double interval = config.frame_interval > 0 ? config.frame_interval : scales.time / 5;
    const double warm_up = config.ranges.warm_up.to * scales.time,
                 duration = warm_up + config.frames * interval;
    if (!(duration <= longest))
        throw std::invalid_argument(
            fmt::format("excitation: {} frames of {:.3g} s after a warm-up of {:.3g} s last {:.3g} s; "
                        "allowed: at most {:.3g} s, {} times what sound needs to cross the body; "
                        "a shorter frame_interval, or 0, which fits the body",
                        config.frames, interval, warm_up, duration, longest, max_duration));
}

namespace {

nlohmann::ordered_json json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::ordered_json json(const Eigen::Matrix3d& m) {
    return {json(Eigen::Vector3d(m.row(0))), json(Eigen::Vector3d(m.row(1))),
            json(Eigen::Vector3d(m.row(2)))};
}

Eigen::Vector3d vector_from(const nlohmann::json& numbers) {
    return {numbers.at(0).get<double>(), numbers.at(1).get<double>(), numbers.at(2).get<double>()};
}

}  // namespace

std::string recipe_json(const Recipe& recipe) {
    nlohmann::ordered_json text;
    text["kind"] = recipe_kind_names[static_cast<std::size_t>(recipe.kind)];
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
    for (const Hand& g : recipe.grips)
        text["grips"].push_back({{"nodes", g.nodes},
                                 {"centre", json(g.move.centre)},
                                 {"translation", json(g.move.translation)},
                                 {"rotation", json(g.move.rotation)},
                                 {"start", g.move.start},
                                 {"duration", g.move.duration},
                                 {"release", g.release}});
    for (const Plate& p : recipe.plates)
        text["plates"].push_back(
            {{"point", json(p.point)}, {"normal", json(p.normal)}, {"speed", p.speed}, {"stop", p.stop}});
    if (recipe.thrown)
        text["thrown"] = {{"rotation", json(recipe.thrown->rotation)},
                          {"centre", json(recipe.thrown->centre)},
                          {"velocity", json(recipe.thrown->velocity)}};
    return text.dump();
}

std::vector<Obstacle> recipe_obstacles(const Recipe& recipe) {
    std::vector<Obstacle> obstacles;
    if (recipe.floor)
        obstacles.push_back(
            {.shape = PlaneShape{.point = {0, 0, *recipe.floor}, .normal = Eigen::Vector3d::UnitZ()}});
    for (const Plate& plate : recipe.plates)
        obstacles.push_back({.shape = PlaneShape{.point = plate.point, .normal = plate.normal},
                             .motion = travel(plate.speed * plate.normal, 0, plate.stop)});
    return obstacles;
}

std::vector<Obstacle> recipe_obstacles(std::string_view json) {
    const auto text = nlohmann::json::parse(json, nullptr, false);
    if (!text.is_object() || !text.contains("kind")) return {};
    Recipe recipe;
    try {
        if (text.contains("floor")) recipe.floor = text["floor"].get<double>();
        for (const auto& plate : text.value("plates", nlohmann::json::array()))
            recipe.plates.push_back({.point = vector_from(plate.at("point")),
                                     .normal = vector_from(plate.at("normal")),
                                     .speed = plate.at("speed").get<double>(),
                                     .stop = plate.at("stop").get<double>()});
    } catch (const nlohmann::json::exception& error) {
        throw std::invalid_argument(std::string("the obstacles of its recipe cannot be read: ") +
                                    error.what());
    }
    std::vector<Obstacle> obstacles = recipe_obstacles(recipe);
    for (const Obstacle& obstacle : obstacles) check_obstacle(obstacle);
    return obstacles;
}

}  // namespace nbd

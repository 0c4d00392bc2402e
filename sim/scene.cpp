#include "sim/scene.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <stdexcept>

#include "sim/json_object.hpp"

namespace nbd {
namespace {

constexpr double largest = 1e30;
constexpr NumberRange positive{1e-30, largest, "> 0"};
constexpr NumberRange not_negative{0, largest, ">= 0"};
constexpr NumberRange finite{-largest, largest, "finite"};

Eigen::Vector3d direction(JsonObject& from, const std::string& key, const Eigen::Vector3d& fallback) {
    const Eigen::Vector3d value = from.vector(key, fallback);
    if (!(value.norm() > 1e-12)) from.fail(key, "must not be zero");
    return value.normalized();
}

/// Radians times axis.
void read_rotation(JsonObject from, Eigen::Vector3d& axis, double& degrees) {
    axis = direction(from, "axis", axis);
    degrees = from.number("degrees", degrees, {-36000, 36000, "between -36000 and 36000"});
    from.finish();
}

Placement read_placement(JsonObject from) {
    Placement placement;
    placement.translate = from.vector("translate", placement.translate);
    read_rotation(from.object("rotate"), placement.axis, placement.degrees);
    placement.scale = from.number("scale", placement.scale, positive);
    from.finish();
    return placement;
}

/// Exactly one of two keys.
void need_one(JsonObject& from, const std::string& path, const std::string& a, const std::string& b) {
    if (from.has(a) == from.has(b))
        throw std::invalid_argument(fmt::format("{}: needs either \"{}\" or \"{}\"", path, a, b));
}

Region read_region(JsonObject from, const std::string& path) {
    need_one(from, path, "box", "sphere");
    Region region;
    if (from.has("box")) {
        JsonObject box = from.object("box");
        const BoxRegion read{box.vector("min", Eigen::Vector3d::Zero()),
                             box.vector("max", Eigen::Vector3d::Zero())};
        if (!box.has("min") || !box.has("max")) box.fail("min", "a box needs \"min\" and \"max\"");
        if ((read.min.array() > read.max.array()).any()) box.fail("max", "must not be below \"min\"");
        box.finish();
        region = read;
    } else {
        JsonObject ball = from.object("sphere");
        if (!ball.has("radius")) ball.fail("radius", "is missing");
        region =
            BallRegion{ball.vector("centre", Eigen::Vector3d::Zero()), ball.number("radius", 0, positive)};
        ball.finish();
    }
    from.finish();
    return region;
}

SceneGrip read_grip(JsonObject& from) {
    SceneGrip grip;
    if (!from.has("region")) from.fail("region", "is missing");
    grip.region = read_region(from.object("region"), from.path("region"));
    grip.motion.centre = from.vector("centre", grip.motion.centre);
    grip.motion.translation = from.vector("translate", grip.motion.translation);
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    double degrees = 0;
    read_rotation(from.object("rotate"), axis, degrees);
    grip.motion.rotation = degrees * std::numbers::pi / 180 * axis;
    grip.motion.start = from.number("start", 0, finite);
    grip.motion.duration = from.number("duration", 0, not_negative);
    grip.motion.release = from.number("release", grip.motion.release, not_negative);
    from.finish();
    return grip;
}

MaterialOverride read_material(JsonObject from) {
    const auto optional = [&](const char* key, const NumberRange& range) -> std::optional<double> {
        if (!from.has(key)) return std::nullopt;
        return from.number(key, 0, range);
    };
    MaterialOverride material;
    material.young = optional("young", positive);
    material.poisson = optional("poisson", {-0.999, 0.499, "between -0.999 and 0.499"});
    material.density = optional("density", positive);
    material.rayleigh_mass = optional("rayleigh_mass", not_negative);
    material.rayleigh_stiffness = optional("rayleigh_stiffness", not_negative);
    from.finish();
    return material;
}

std::filesystem::path read_path(JsonObject& from, const std::string& key, const std::filesystem::path& base) {
    const std::string text = from.text(key, "");
    if (text.empty()) from.fail(key, "must not be empty");
    return base / text;
}

SceneBody read_body(JsonObject& from, const std::string& path, const std::filesystem::path& base) {
    SceneBody body;
    need_one(from, path, "body", "surface");
    body.is_surface = from.has("surface");
    body.file = read_path(from, body.is_surface ? "surface" : "body", base);
    body.name = from.text("name", body.file.stem().string());
    if (from.has("tree")) body.tree = read_path(from, "tree", base);
    const std::string bounds = from.text("bounds", "exact");
    try {
        body.bounds = bound_kind(bounds);
    } catch (const std::invalid_argument& error) {
        from.fail("bounds", error.what());
    }
    if (body.bounds != BoundKind::exact && body.tree.empty())
        from.fail("tree",
                  fmt::format("is missing: bounds \"{}\" are learned or precomputed and need a tree file",
                              name(body.bounds)));
    body.margin = from.number("margin", 0, {0, 10, "between 0 and 10"});
    body.placement = read_placement(from.object("transform"));
    if (body.placement.scale != 1 && body.bounds != BoundKind::exact)
        from.fail("transform.scale", "must be 1 unless bounds are \"exact\"");
    body.velocity = from.vector("velocity", body.velocity);
    body.material = read_material(from.object("material"));
    for (JsonObject& pin : from.objects("pins")) body.grips.push_back({read_region(pin, pin.path("")), {}});
    for (JsonObject& grip : from.objects("grips")) body.grips.push_back(read_grip(grip));
    from.finish();
    return body;
}

SceneObstacle read_obstacle(JsonObject& from, const std::string& path, const std::filesystem::path& base) {
    SceneObstacle result;
    if (from.has("plane") + from.has("sphere") + from.has("mesh") != 1)
        throw std::invalid_argument(
            fmt::format("{}: needs exactly one of \"plane\", \"sphere\" and \"mesh\"", path));
    if (from.has("plane")) {
        JsonObject plane = from.object("plane");
        result.obstacle.shape = PlaneShape{.point = plane.vector("point", Eigen::Vector3d::Zero()),
                                           .normal = direction(plane, "normal", Eigen::Vector3d::UnitZ())};
        plane.finish();
    } else if (from.has("sphere")) {
        JsonObject ball = from.object("sphere");
        if (!ball.has("radius")) ball.fail("radius", "is missing");
        result.obstacle.shape = BallShape{.centre = ball.vector("centre", Eigen::Vector3d::Zero()),
                                          .radius = ball.number("radius", 1, positive)};
        ball.finish();
    } else {
        JsonObject mesh = from.object("mesh");
        result.mesh = read_path(mesh, "file", base);
        result.placement = read_placement(mesh.object("transform"));
        result.obstacle.shape = std::shared_ptr<const StaticSurface>();
        mesh.finish();
    }
    result.obstacle.velocity = from.vector("velocity", result.obstacle.velocity);
    result.obstacle.friction = from.number("friction", result.obstacle.friction, {0, 10, "between 0 and 10"});
    from.finish();
    return result;
}

ContactConfig read_contact(JsonObject from) {
    ContactConfig contact;
    contact.stiffness_scale = from.number("stiffness_scale", contact.stiffness_scale, positive);
    contact.friction = from.number("friction", contact.friction, {0, 10, "between 0 and 10"});
    contact.thickness = from.number("thickness", contact.thickness, not_negative);
    contact.damping = from.number("damping", contact.damping, not_negative);
    from.finish();
    return contact;
}

SceneTime read_time(JsonObject from) {
    SceneTime time;
    time.dt = from.number("dt", time.dt, {1e-7, 1, "between 1e-7 and 1"});
    time.frames = static_cast<int>(from.integer("frames", time.frames, {1, 1e6, "between 1 and 1000000"}));
    time.steps_per_frame = static_cast<int>(
        from.integer("steps_per_frame", time.steps_per_frame, {1, 1e4, "between 1 and 10000"}));
    from.finish();
    return time;
}

}  // namespace

Eigen::Matrix3d Placement::rotation() const {
    return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis).toRotationMatrix();
}

void MaterialOverride::apply(Material& material) const {
    material.young = young.value_or(material.young);
    material.poisson = poisson.value_or(material.poisson);
    material.density = density.value_or(material.density);
    material.rayleigh_mass = rayleigh_mass.value_or(material.rayleigh_mass);
    material.rayleigh_stiffness = rayleigh_stiffness.value_or(material.rayleigh_stiffness);
}

SceneSpec parse_scene(std::string_view text, const std::filesystem::path& base) {
    const nlohmann::json json = parse_json(text);
    JsonObject from(json, "");
    SceneSpec spec;
    from.text("$schema", "");
    if (!from.has("bodies")) from.fail("bodies", "is missing");
    int index = 0;
    for (JsonObject& body : from.objects("bodies"))
        spec.bodies.push_back(read_body(body, fmt::format("bodies[{}]", index++), base));
    if (spec.bodies.empty()) from.fail("bodies", "must hold at least one body");
    index = 0;
    for (JsonObject& obstacle : from.objects("obstacles"))
        spec.obstacles.push_back(read_obstacle(obstacle, fmt::format("obstacles[{}]", index++), base));
    spec.gravity = from.vector("gravity", spec.gravity);
    spec.contact = read_contact(from.object("contact"));
    spec.time = read_time(from.object("time"));
    spec.seed = static_cast<std::uint64_t>(from.integer("seed", 0, {0, 9e15, "between 0 and 9e15"}));
    from.finish();
    return spec;
}

SceneSpec load_scene(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file || std::filesystem::is_directory(path))
        throw std::runtime_error(fmt::format("{}: cannot read the scene", path.string()));
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    try {
        return parse_scene(text, path.parent_path());
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("{}: {}", path.string(), error.what()));
    }
}

}  // namespace nbd

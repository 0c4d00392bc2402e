#include "sim/scene/scene.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "collision/base/file_name.hpp"
#include "collision/base/file_text.hpp"
#include "collision/base/notice.hpp"
#include "meshing/body/material.hpp"

namespace nbd {
namespace {

constexpr NumberRange positive{least_constant, max_constant, "between 1e-30 and 1e30"};
constexpr NumberRange not_negative{0, max_constant, "between 0 and 1e30"};
constexpr NumberRange finite{-max_constant, max_constant, "between -1e30 and 1e30"};

Eigen::Vector3d direction(JsonObject& from, const std::string& key, const Eigen::Vector3d& fallback) {
    const Eigen::Vector3d value = from.vector(key, fallback);
    if (value.norm() > 1e-12) return value.normalized();
    from.problem(key, "must not be zero");
    return fallback;
}

/// Reads a rotation as an axis and an angle in degrees.
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

BallShape read_ball(JsonObject from) {
    BallShape ball{.centre = from.vector("centre", Eigen::Vector3d::Zero()), .radius = 1};
    if (from.need("radius")) ball.radius = from.optional_number("radius", positive).value_or(1);
    from.finish();
    return ball;
}

Eigen::AlignedBox3d read_box(JsonObject from) {
    const Eigen::AlignedBox3d box(from.vector("min", Eigen::Vector3d::Zero()),
                                  from.vector("max", Eigen::Vector3d::Zero()));
    if (from.need("min") && from.need("max") && box.isEmpty())
        from.problem("max", "must not be below \"min\"");
    from.finish();
    return box;
}

Region read_region(JsonObject from) {
    const std::string kind = from.need_one({"box", "sphere"});
    Region region;
    if (kind == "box") region = read_box(from.object("box"));
    if (kind == "sphere") region = read_ball(from.object("sphere"));
    from.finish();
    return region;
}

/// Last part of an object's path: "pins[1]".
std::string key_of(const JsonObject& object) {
    const std::string path = object.path("");
    return path.substr(path.rfind('.') + 1);
}

SceneGrip read_grip(JsonObject& from) {
    SceneGrip grip{.key = key_of(from), .region = {}, .motion = {}};
    if (from.need("region")) grip.region = read_region(from.object("region"));
    grip.motion.centre = from.vector("centre", grip.motion.centre);
    grip.motion.translation = from.vector("translate", grip.motion.translation);
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    double degrees = 0;
    read_rotation(from.object("rotate"), axis, degrees);
    grip.motion.rotation = degrees * std::numbers::pi / 180 * axis;
    grip.motion.start = from.number("start", 0, finite);
    grip.motion.duration = from.number("duration", 0, not_negative);
    grip.motion.release = from.number("release", grip.motion.release, not_negative);
    if (grip.motion.release < grip.motion.start) from.problem("release", "must not be before \"start\"");
    from.finish();
    return grip;
}

/// Of a region, which has no damping of its own.
MaterialChange read_elasticity(JsonObject& from) {
    MaterialChange material;
    std::vector<std::string> laws;
    for (const MaterialLaw law : material_laws) laws.emplace_back(name(law));
    material.law = material_law(from.choice("law", "", laws));
    material.young = from.optional_number("young", positive);
    material.poisson =
        from.optional_number("poisson", {least_poisson, max_poisson, "between -0.999 and 0.499"});
    material.density = from.optional_number("density", positive);
    return material;
}

MaterialChange read_material(JsonObject from) {
    MaterialChange material = read_elasticity(from);
    material.rayleigh_mass = from.optional_number("rayleigh_mass", not_negative);
    material.rayleigh_stiffness = from.optional_number("rayleigh_stiffness", not_negative);
    from.finish();
    return material;
}

SceneMaterialRegion read_material_region(JsonObject& from) {
    SceneMaterialRegion region{.key = key_of(from), .group = {}, .where = {}, .material = {}};
    const std::string kind = from.need_one({"group", "region"});
    if (kind == "group") {
        region.group = from.text("group", "");
        if (region.group.empty()) from.problem("group", "must be the name of a group");
    }
    if (kind == "region") region.where = read_region(from.object("region"));
    JsonObject material = from.object("material");
    region.material = read_elasticity(material);
    material.finish();
    from.finish();
    return region;
}

/// A path relative to base. Empty if the key is missing or wrong; an empty text is a problem.
std::filesystem::path read_path(JsonObject& from, const std::string& key, const std::filesystem::path& base) {
    const std::string text = from.text(key, "");
    if (!text.empty()) return (base / text).lexically_normal();
    if (from.has(key)) from.problem(key, "must not be empty");
    return {};
}

SceneMeshing read_meshing(JsonObject from, BodySource source) {
    SceneMeshing meshing;
    meshing.tets.nodes = from.integer("nodes", 0, {0, 1e8, "between 0 and 100000000"});
    meshing.tets.grading = from.number("grading", meshing.tets.grading, {0, 2, "between 0 and 2"});
    meshing.edge = from.number("edge", meshing.edge, not_negative);
    if (meshing.edge > 0 && meshing.tets.nodes > 0) from.problem("nodes", "must not be beside \"edge\"");
    const bool is_linear = from.choice("elements", "linear", {"linear", "quadratic"}) == "linear";
    if (from.has("elements")) meshing.elements = is_linear ? Elements::linear : Elements::quadratic;
    meshing.scale = from.number("scale", meshing.scale, positive);
    meshing.weld = from.number("weld", meshing.weld, not_negative);
    meshing.levels = from.integer("subdivide", 0, {0, 4, "between 0 and 4"});
    if (from.choice("subdivision", "midpoint", {"midpoint", "loop"}) == "loop")
        meshing.scheme = SubdivisionScheme::loop;
    if (source == BodySource::tets)
        for (const char* key : {"edge", "nodes", "grading", "weld"})
            if (from.has(key))
                from.problem(key, "applies to surfaces only; given tetrahedra are not remeshed");
    from.finish();
    return meshing;
}

void read_source(JsonObject& from, const std::filesystem::path& base, SceneBody& body) {
    const std::string kind = from.need_one({"body", "surface", "tets"});
    body.source = kind == "surface" ? BodySource::surface
                  : kind == "tets"  ? BodySource::tets
                                    : BodySource::body;
    if (!kind.empty()) body.file = read_path(from, kind, base);
    body.meshing = read_meshing(from.object("meshing"), body.source);
    if (kind == "body" && from.has("meshing"))
        from.problem("meshing", "applies to surfaces and tetrahedra only; a body file is used unchanged");
}

void read_bounds(JsonObject& from, const std::filesystem::path& base, SceneBody& body) {
    body.tree = read_path(from, "tree", base);
    body.bounds = bound_kind(from.choice("bounds", "auto",
                                         {"exact", "boxes", "bd", "nbd", "learned_affine", "affine", "auto"},
                                         instead_of_bound));
    body.margin = from.optional_number("margin", {0, 10, "between 0 and 10"});
    if (!can_miss(body.bounds)) return;
    if (!from.has("tree"))
        from.problem("tree",
                     fmt::format("is missing: bounds \"{}\" are learned or precomputed and need a tree file",
                                 name(body.bounds)));
    if (body.placement.scale != 1)
        from.problem("transform.scale",
                     "must be 1 unless bounds are \"auto\", \"affine\", \"boxes\" or \"exact\"");
}

SceneBody read_body(JsonObject& from, const std::filesystem::path& base) {
    SceneBody body;
    read_source(from, base, body);
    body.name = from.text("name", "");
    if (body.name.empty()) body.name = body.file.stem().string();
    body.placement = read_placement(from.object("transform"));
    read_bounds(from, base, body);
    body.velocity = from.vector("velocity", body.velocity);
    body.angular_velocity = from.vector("angular_velocity", body.angular_velocity);
    body.material = read_material(from.object("material"));
    for (JsonObject& region : from.objects("regions")) body.regions.push_back(read_material_region(region));
    for (JsonObject& pin : from.objects("pins")) {
        SceneGrip held{.key = key_of(pin), .region = {}, .motion = {}};
        held.region = read_region(std::move(pin));
        body.grips.push_back(std::move(held));
    }
    for (JsonObject& grip : from.objects("grips")) body.grips.push_back(read_grip(grip));
    from.finish();
    return body;
}

SceneObstacle read_obstacle(JsonObject& from, const std::filesystem::path& base) {
    SceneObstacle result;
    const std::string kind = from.need_one({"plane", "sphere", "mesh"});
    if (kind == "plane") {
        JsonObject plane = from.object("plane");
        result.obstacle.shape = PlaneShape{.point = plane.vector("point", Eigen::Vector3d::Zero()),
                                           .normal = direction(plane, "normal", Eigen::Vector3d::UnitZ())};
        plane.finish();
    } else if (kind == "sphere") {
        result.obstacle.shape = read_ball(from.object("sphere"));
    } else if (kind == "mesh") {
        JsonObject mesh = from.object("mesh");
        if (mesh.need("file")) result.mesh = read_path(mesh, "file", base);
        result.placement = read_placement(mesh.object("transform"));
        result.obstacle.shape = std::shared_ptr<const StaticSurface>();
        mesh.finish();
    }
    result.obstacle.velocity = from.vector("velocity", result.obstacle.velocity);
    result.obstacle.friction = from.number("friction", result.obstacle.friction, {0, 10, "between 0 and 10"});
    result.obstacle.start = from.number("start", result.obstacle.start, finite);
    result.obstacle.stop = from.number("stop", result.obstacle.stop, finite);
    if (result.obstacle.stop < result.obstacle.start) from.problem("stop", "must not be before \"start\"");
    from.finish();
    return result;
}

std::string_view instead_of_integrator(std::string_view name) noexcept {
    return name == "bdf2" ? "second_order" : "";
}

StepConfig read_solver(JsonObject from) {
    StepConfig step;
    from.gone("most_substeps", "max_substeps");
    if (from.choice("integrator", "second_order", {"second_order", "backward_euler"},
                    instead_of_integrator) == "backward_euler")
        step.integrator = TimeIntegrator::backward_euler;
    if (from.choice("tangent", "rotated", {"rotated", "full"}) == "full") step.tangent = Tangent::full;
    step.newton_iterations =
        from.integer("newton_iterations", step.newton_iterations, {1, 100, "between 1 and 100"});
    step.newton_tolerance =
        from.number("newton_tolerance", step.newton_tolerance, {1e-12, 1, "between 1e-12 and 1"});
    step.max_substeps = from.integer("max_substeps", step.max_substeps, {1, 1024, "between 1 and 1024"});
    if ((step.max_substeps & (step.max_substeps - 1)) != 0)
        from.problem("max_substeps", "must be a power of two");
    from.finish();
    return step;
}

/// One line about each key that has lost its meaning.
void tell_obsolete(JsonObject& from) {
    constexpr std::pair<const char*, const char*> obsolete[]{
        {"damping", "what contacts take of an impact follows from the materials"},
        {"contacts_per_node_pair", "all contacts count"},
        {"slip_velocity", "what friction holds does not creep"},
    };
    for (const auto& [key, why] : obsolete)
        if (from.has(key)) notice(fmt::format("{}: has no effect any more; {}", from.path(key), why));
    for (const char* key : {"self_contact", "intersection_free"})
        if (!from.flag(key, true))
            notice(
                fmt::format("{}: has no effect any more; no step ends with faces that intersect, of one "
                            "body neither",
                            from.path(key)));
}

ContactConfig read_contact(JsonObject from, bool& resolve_start) {
    ContactConfig contact;
    contact.stiffness_scale = from.number("stiffness_scale", contact.stiffness_scale, positive);
    contact.friction = from.number("friction", contact.friction, {0, 10, "between 0 and 10"});
    contact.thickness = from.number("thickness", contact.thickness, not_negative);
    tell_obsolete(from);
    resolve_start = from.flag("resolve_start", resolve_start);
    from.finish();
    return contact;
}

SceneTime read_time(JsonObject from) {
    SceneTime time;
    time.dt = from.number("dt", time.dt, {1e-7, 1, "between 1e-7 and 1"});
    time.frames = from.integer("frames", time.frames, {1, 1e6, "between 1 and 1000000"});
    time.steps_per_frame =
        from.integer("steps_per_frame", time.steps_per_frame, {1, 1e4, "between 1 and 10000"});
    from.finish();
    return time;
}

/// The path of a file whose name must end in `extension`.
std::filesystem::path read_file_path(JsonObject& from, const std::string& key, std::string_view extension) {
    std::filesystem::path path = read_path(from, key, "");
    if (!path.empty() && !has_extension(path, extension))
        from.problem(key, fmt::format("is \"{}\", but must end in {}", path.string(), extension));
    return path;
}

SceneOutput read_output(JsonObject from) {
    SceneOutput output;
    output.recording = read_file_path(from, "recording", ".h5");
    output.csv = read_file_path(from, "csv", ".csv");
    output.vtu = read_path(from, "vtu", "");
    output.obj = read_path(from, "obj", "");
    output.picture = read_file_path(from, "picture", ".png");
    from.finish();
    return output;
}

}  // namespace

Eigen::Matrix3d Placement::rotation() const {
    return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis).toRotationMatrix();
}

SceneReading read_scene(std::string_view text, const std::filesystem::path& base) {
    const nlohmann::json json = parse_json(text);
    JsonReading reading;
    JsonObject from(json, "", &reading);
    SceneReading result;
    SceneSpec& spec = result.spec;
    spec.text = text;
    from.text("$schema", "");
    if (from.need("bodies") && json["bodies"].is_array() && json["bodies"].empty())
        from.problem("bodies", "must hold at least one body");
    for (JsonObject& body : from.objects("bodies")) {
        const std::size_t before = reading.problems.size();
        spec.bodies.push_back(read_body(body, base));
        result.body_is_good.push_back(reading.problems.size() == before);
    }
    for (JsonObject& obstacle : from.objects("obstacles")) {
        const std::size_t before = reading.problems.size();
        spec.obstacles.push_back(read_obstacle(obstacle, base));
        result.obstacle_is_good.push_back(reading.problems.size() == before);
    }
    spec.gravity = from.vector("gravity", spec.gravity);
    spec.contact = read_contact(from.object("contact"), spec.resolve_start);
    spec.step = read_solver(from.object("solver"));
    spec.time = read_time(from.object("time"));
    spec.output = read_output(from.object("output"));
    spec.seed = from.integer("seed", 0, {0, 9e15, "between 0 and 9e15"});
    from.finish();
    result.problems = std::move(reading.problems);
    result.fields = std::move(reading.fields);
    return result;
}

SceneSpec parse_scene(std::string_view text, const std::filesystem::path& base) {
    SceneReading reading = read_scene(text, base);
    if (!reading.problems.empty()) throw std::invalid_argument(reading.problems.front());
    return std::move(reading.spec);
}

SceneSpec load_scene(const std::filesystem::path& path) {
    const std::string text = file_text(path);
    try {
        return parse_scene(text, path.parent_path());
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("{}: {}", path.string(), error.what()));
    }
}

}  // namespace nbd

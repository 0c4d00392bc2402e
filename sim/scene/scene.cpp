#include "sim/scene/scene.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "collision/base/file_name.hpp"
#include "collision/base/file_text.hpp"
#include "collision/base/notice.hpp"
#include "sim/scene/read_parts.hpp"
#include "sim/scene/scene_template.hpp"

namespace nbd {
namespace {

std::string_view instead_of_integrator(std::string_view name) noexcept {
    return name == "bdf2" ? "second_order" : "";
}

/// time: static increments have linearisations of their own.
StepConfig read_solver(JsonObject from, SceneTime& time) {
    StepConfig step;
    from.gone("most_substeps", "max_substeps");
    if (from.choice("integrator", "second_order", {"second_order", "backward_euler"},
                    instead_of_integrator) == "backward_euler")
        step.integrator = TimeIntegrator::backward_euler;
    if (from.choice("tangent", "rotated", {"rotated", "full"}) == "full") step.tangent = Tangent::full;
    if (time.statics)
        time.statics->newton_iterations = from.integer("newton_iterations", time.statics->newton_iterations,
                                                       {1, 1e4, "between 1 and 10000"});
    else
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

ContactConfig read_contact(JsonObject from, SceneSpec& spec) {
    ContactConfig contact;
    contact.stiffness_scale = from.number("stiffness_scale", contact.stiffness_scale, positive_number);
    contact.friction = from.number("friction", contact.friction, {0, 10, "between 0 and 10"});
    contact.thickness = from.number("thickness", contact.thickness, not_negative);
    tell_obsolete(from);
    spec.resolve_start = from.flag("resolve_start", spec.resolve_start);
    spec.pairs = read_pairs(from, spec);
    from.finish();
    return contact;
}

SceneTime read_time(JsonObject from) {
    SceneTime time;
    if (from.has("static")) return read_static_time(from);
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
    output.reactions = read_file_path(from, "reactions", ".csv");
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
    const std::string plain = without_comments(text);
    const nlohmann::json json = parse_json(plain);
    JsonReading reading;
    JsonObject from(json, "", &reading);
    SceneReading result;
    SceneSpec& spec = result.spec;
    spec.text = plain;
    from.text("$schema", "");
    if (!read_variables(from).empty())
        from.problem(
            "variables",
            "make the scene a template, which has no values yet; allowed: nbdtree dataset, which draws "
            "its trajectories, and nbdtree simulate --trajectory K, which runs one of them");
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
    read_gravity(from, spec);
    spec.time = read_time(from.object("time"));
    spec.joints = read_joints(from, spec);
    read_tendons(from, spec);
    const std::size_t before_regions = reading.problems.size();
    check_regions(from, spec);
    for (std::size_t k = before_regions; k < reading.problems.size(); ++k)
        for (std::size_t b = 0; b < spec.bodies.size(); ++b)
            if (reading.problems[k].starts_with(fmt::format("bodies[{}].", b)))
                result.body_is_good[b] = false;
    spec.contact = read_contact(from.object("contact"), spec);
    spec.step = read_solver(from.object("solver"), spec.time);
    if (spec.time.statics) refuse_motion(json, reading);
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

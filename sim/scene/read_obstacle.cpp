#include <memory>
#include <string>

#include "sim/obstacles/made_mesh.hpp"
#include "sim/scene/read_parts.hpp"

namespace nbd {
namespace {

constexpr NumberRange side_count{3, 1024, "between 3 and 1024"};

/// A length that must be there.
double read_length(JsonObject& from, const char* key) {
    if (!from.need(key)) return 1;
    return from.optional_number(key, positive_number).value_or(1);
}

/// Of a shape that is made as a mesh.
TriMesh read_made_mesh(JsonObject& from, const std::string& kind) {
    if (kind == "box") {
        const bool is_there = from.need("size");
        const Eigen::Vector3d size = from.vector("size", Eigen::Vector3d::Zero());
        if (size.minCoeff() >= least_constant) return box_mesh(size);
        if (is_there) from.problem("size", "must be three positive lengths");
        return box_mesh(Eigen::Vector3d::Ones());
    }
    const double radius = read_length(from, "radius"), length = read_length(from, "length");
    const int segments = static_cast<int>(from.integer("segments", 48, side_count));
    return kind == "cylinder" ? cylinder_mesh(radius, length, segments)
                              : capsule_mesh(radius, length, segments);
}

SurfaceRecording read_recording(JsonObject& from, const std::filesystem::path& base) {
    SurfaceRecording recording;
    if (from.need("file")) recording.file = read_path(from, "file", base);
    if (from.need("body")) recording.body = read_path(from, "body", base);
    recording.trajectory =
        static_cast<int>(from.integer("trajectory", 0, {0, 1e9, "between 0 and 1000000000"}));
    recording.start = from.number("start", recording.start, finite_number);
    recording.speed = from.number("speed", recording.speed, positive_number);
    return recording;
}

}  // namespace

SceneObstacle read_obstacle(JsonObject& from, const std::filesystem::path& base) {
    SceneObstacle result;
    result.name = from.text("name", "");
    if (result.name.empty()) result.name = from.path("");
    const std::string kind =
        from.need_one({"plane", "sphere", "box", "cylinder", "capsule", "heights", "mesh", "recording"});
    if (kind == "plane") {
        JsonObject plane = from.object("plane");
        result.obstacle.shape =
            PlaneShape{.point = plane.vector("point", Eigen::Vector3d::Zero()),
                       .normal = read_direction(plane, "normal", Eigen::Vector3d::UnitZ())};
        plane.finish();
    } else if (kind == "sphere") {
        result.obstacle.shape = read_ball(from.object("sphere"));
    } else if (!kind.empty()) {
        JsonObject mesh = from.object(kind);
        if (kind == "heights")
            read_heights(mesh, base, result);
        else if (kind == "recording")
            result.recording = read_recording(mesh, base);
        else if (kind != "mesh")
            result.made = read_made_mesh(mesh, kind);
        else if (mesh.need("file"))
            result.mesh = read_path(mesh, "file", base);
        result.placement = read_placement(mesh.object("transform"));
        result.obstacle.shape = std::shared_ptr<const StaticSurface>();
        mesh.finish();
    }
    result.obstacle.motion = read_obstacle_motion(from);
    result.obstacle.friction = from.number("friction", result.obstacle.friction, {0, 10, "between 0 and 10"});
    from.finish();
    return result;
}

}  // namespace nbd

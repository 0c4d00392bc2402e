#include "sim/scene/read_parts.hpp"

namespace nbd {

SceneObstacle read_obstacle(JsonObject& from, const std::filesystem::path& base) {
    SceneObstacle result{.name = from.text("name", ""), .obstacle = {}, .mesh = {}, .placement = {}};
    if (result.name.empty()) result.name = from.path("");
    const std::string kind = from.need_one({"plane", "sphere", "mesh"});
    if (kind == "plane") {
        JsonObject plane = from.object("plane");
        result.obstacle.shape =
            PlaneShape{.point = plane.vector("point", Eigen::Vector3d::Zero()),
                       .normal = read_direction(plane, "normal", Eigen::Vector3d::UnitZ())};
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
    result.obstacle.start = from.number("start", result.obstacle.start, finite_number);
    result.obstacle.stop = from.number("stop", result.obstacle.stop, finite_number);
    if (result.obstacle.stop < result.obstacle.start) from.problem("stop", "must not be before \"start\"");
    from.finish();
    return result;
}

}  // namespace nbd

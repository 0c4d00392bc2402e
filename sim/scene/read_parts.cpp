#include "sim/scene/read_parts.hpp"

namespace nbd {
Eigen::Vector3d read_direction(JsonObject& from, const std::string& key, const Eigen::Vector3d& fallback) {
    const Eigen::Vector3d value = from.vector(key, fallback);
    if (value.norm() > 1e-12) return value.normalized();
    from.problem(key, "must not be zero");
    return fallback;
}

void read_rotation(JsonObject from, Eigen::Vector3d& axis, double& degrees) {
    axis = read_direction(from, "axis", axis);
    degrees = from.number("degrees", degrees, {-36000, 36000, "between -36000 and 36000"});
    from.finish();
}

Placement read_placement(JsonObject from) {
    Placement placement;
    placement.translate = from.vector("translate", placement.translate);
    read_rotation(from.object("rotate"), placement.axis, placement.degrees);
    placement.scale = from.number("scale", placement.scale, positive_number);
    from.finish();
    return placement;
}

BallShape read_ball(JsonObject from) {
    BallShape ball{.centre = from.vector("centre", Eigen::Vector3d::Zero()), .radius = 1};
    if (from.need("radius")) ball.radius = from.optional_number("radius", positive_number).value_or(1);
    from.finish();
    return ball;
}

std::string key_of(const JsonObject& object) {
    const std::string path = object.path("");
    return path.substr(path.rfind('.') + 1);
}

std::filesystem::path read_path(JsonObject& from, const std::string& key, const std::filesystem::path& base) {
    const std::string text = from.text(key, "");
    if (!text.empty()) return (base / text).lexically_normal();
    if (from.has(key)) from.problem(key, "must not be empty");
    return {};
}

}  // namespace nbd

#pragma once

#include <filesystem>
#include <string>

#include "sim/json/json_object.hpp"
#include "sim/scene/scene.hpp"

// Readers of the parts of a scene, for read_scene().
namespace nbd {

inline constexpr NumberRange positive_number{least_constant, max_constant, "between 1e-30 and 1e30"};
inline constexpr NumberRange not_negative{0, max_constant, "between 0 and 1e30"};
inline constexpr NumberRange finite_number{-max_constant, max_constant, "between -1e30 and 1e30"};

/// A unit vector.
Eigen::Vector3d read_direction(JsonObject& from, const std::string& key, const Eigen::Vector3d& fallback);

/// Reads a rotation as an axis and an angle in degrees.
void read_rotation(JsonObject from, Eigen::Vector3d& axis, double& degrees);

Placement read_placement(JsonObject from);
BallShape read_ball(JsonObject from);
Region read_region(JsonObject from);
/// The regions of a scene, with those that they are made of.
std::vector<Region*> regions_of(SceneSpec& spec);
/// Checks that the bodies and obstacles are there that regions are near to. top: the scene.
void check_regions(const JsonObject& top, SceneSpec& spec);

/// When and how a grip moves: its take, release, keyframes and centre, or the short form of one move.
Grip read_held_motion(JsonObject& from);
/// The keyframes of an obstacle and their centre, or the short form of a velocity.
Motion read_obstacle_motion(JsonObject& from);

/// Last part of an object's path: "pins[1]".
std::string key_of(const JsonObject& object);

/// A path relative to base. Empty if the key is missing or wrong; an empty text is a problem.
std::filesystem::path read_path(JsonObject& from, const std::string& key, const std::filesystem::path& base);

SceneBody read_body(JsonObject& from, const std::filesystem::path& base);
SceneObstacle read_obstacle(JsonObject& from, const std::filesystem::path& base);
/// The shape of an obstacle from `heights`.
void read_heights(JsonObject& from, const std::filesystem::path& base, SceneObstacle& obstacle);

SceneFriction read_surface_friction(JsonObject& from);

SceneLoad read_load(JsonObject& from);
SceneLoad read_muscle(JsonObject& from);

/// Reads `gravity`, a vector or keyframes of it.
void read_gravity(JsonObject& from, SceneSpec& spec);

/// The rules `pairs` of `contact`. spec: with its bodies and obstacles.
std::vector<ScenePair> read_pairs(JsonObject& contact, const SceneSpec& spec);

/// Finds the bodies and obstacles that keys name. A name that is wrong is a problem, and is taken as 0.
class SceneNames {
 public:
    explicit SceneNames(const SceneSpec& spec);
    int body(const JsonObject& from, const std::string& key, const std::string& name) const;
    int obstacle(const JsonObject& from, const std::string& key, const std::string& name) const;

 private:
    std::vector<std::string> bodies_, obstacles_;
};

/// A number by keyframes: pairs of a time and a value.
Keyed<double> read_keyed(JsonObject& from, const char* key);

/// Reads `time` of a scene whose bodies come to balance, with its key `static`.
SceneTime read_static_time(JsonObject& from);
/// Makes a problem of each key of such a scene that has to do with motion.
void refuse_motion(const nlohmann::json& scene, JsonReading& reading);

std::vector<SceneJoint> read_joints(JsonObject& from, const SceneSpec& spec);
/// Adds tendons to the scene. Such a one is a cord with its tension from each of its points to the next:
/// without friction, that is the same all along it. One of a given length has its tension from
/// World::add_tendon().
void read_tendons(JsonObject& from, SceneSpec& spec);

}  // namespace nbd

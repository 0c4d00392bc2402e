#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "meshing/body/body.hpp"
#include "meshing/surface/subdivide.hpp"
#include "meshing/tets/tetrahedralize.hpp"
#include "sim/json/json_object.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// x = rotation by `degrees` about `axis`, of `scale` times the point, plus `translate`.
struct Placement {
    Eigen::Vector3d translate = Eigen::Vector3d::Zero();
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    double degrees = 0;
    double scale = 1;

    Eigen::Matrix3d rotation() const;
};

/// A region of space, in world coordinates at time 0: of a box or a ball.
struct BoxRegion {
    Eigen::Vector3d min, max;
};
struct BallRegion {
    Eigen::Vector3d centre;
    double radius;
};
using Region = std::variant<BoxRegion, BallRegion>;

struct SceneGrip {
    std::string key;  // "pins[1]", for messages
    Region region;
    Grip motion;  // without nodes
};

/// Material constants that a scene sets in place of the body's own.
struct MaterialOverride {
    std::optional<double> young, poisson, density, rayleigh_mass, rayleigh_stiffness;
    void apply(Material& material) const;
};

/// What a body is made from.
enum class BodySource {
    body,     // a body file
    surface,  // a closed surface, to be filled with tetrahedra
    tets,     // tetrahedra made elsewhere
};

/// How a surface is filled, and how fine the collision surface is.
struct SceneMeshing {
    TetrahedralizeConfig tets;
    int levels = 0;  // of subdivision
    SubdivisionScheme scheme = SubdivisionScheme::midpoint;
};

struct SceneBody {
    std::string name;
    BodySource source = BodySource::body;
    std::filesystem::path file;
    SceneMeshing meshing;
    std::filesystem::path tree;  // empty: none, exact bounds need no file
    BoundKind bounds = BoundKind::exact;
    std::optional<double> margin;  // of the spheres, relative; none: as the tree was calibrated
    Placement placement;
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          // m/s
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  // rad/s, about the centre of mass
    MaterialOverride material;
    std::vector<SceneGrip> grips;
};

struct SceneObstacle {
    Obstacle obstacle;           // a mesh's shape is null until the world is built
    std::filesystem::path mesh;  // empty: none
    Placement placement;         // of the mesh
};

struct SceneTime {
    double dt = 5e-3;  // seconds a step
    int frames = 100;
    int steps_per_frame = 2;
};

/// What a run writes, as the scene says it; empty: not written. The recording is relative to the working
/// directory, the others to the recording's folder.
struct SceneOutput {
    std::filesystem::path recording, csv, vtu, obj, picture;
};

/// A scene as its JSON text says it, paths made absolute or relative to the working directory; nothing is
/// loaded yet.
struct SceneSpec {
    std::string text;  // as it was read
    std::vector<SceneBody> bodies;
    std::vector<SceneObstacle> obstacles;
    Eigen::Vector3d gravity{0, 0, -9.81};
    ContactConfig contact;
    StepConfig step;
    SceneTime time;
    SceneOutput output;
    std::uint64_t seed = 0;  // carried into recordings
};

/// A scene with everything that is wrong in its text.
struct SceneReading {
    SceneSpec spec;  // defaults in place of what is wrong
    std::vector<std::string> problems;
    std::vector<bool> body_is_good, obstacle_is_good;  // nothing in them is wrong; one per spec.bodies, ...
    std::vector<JsonField> fields;                     // every key that a scene may have, where it was met
};

/// Reads a scene. All keys but `bodies` may be left out; assets/scenes/README.md explains each of them,
/// assets/scenes/scene.schema.json lists them for editors, the defaults are those of the structs above.
/// base: folder that relative paths start from. Throws std::invalid_argument, one line: a syntax error with
/// line and column; a key that is there twice, a wrong type, a number out of range or an unknown key with its
/// JSON path, what was allowed, and the nearest known key. The first problem only.
SceneSpec parse_scene(std::string_view text, const std::filesystem::path& base);

/// As parse_scene(), but goes on after a problem. Throws only where the text is no JSON or has a key twice.
SceneReading read_scene(std::string_view text, const std::filesystem::path& base);

/// The text of the scene file at `path`. Throws std::runtime_error with path and reason where it cannot be
/// read.
std::string scene_text(const std::filesystem::path& path);

/// Reads the file at `path`: scene_text() and parse_scene(); messages start with the path.
SceneSpec load_scene(const std::filesystem::path& path);

/// What a scene's body stands for.
struct LoadedBody {
    Body body;
    std::shared_ptr<const CollisionTree> tree;  // null: one with exact bounds is built
};

/// Puts a scene together. bodies: one per spec.bodies, in that order, as loaded from their files; scene
/// materials and placements are applied here. Reads the obstacles' meshes. Throws std::invalid_argument or
/// std::runtime_error, one line, on what does not fit: a count, a tree of another surface, learned bounds
/// with a scale or without a tree, a region without nodes, a mesh that cannot be used.
World build_world(const SceneSpec& spec, std::span<const LoadedBody> bodies);

}  // namespace nbd

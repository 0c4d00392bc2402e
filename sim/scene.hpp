#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "collision/collision_tree.hpp"
#include "meshing/body.hpp"
#include "sim/world.hpp"

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
    Region region;
    Grip motion;  // without nodes
};

/// Material constants that a scene sets in place of the body's own.
struct MaterialOverride {
    std::optional<double> young, poisson, density, rayleigh_mass, rayleigh_stiffness;
    void apply(Material& material) const;
};

struct SceneBody {
    std::string name;
    std::filesystem::path file;  // a body file, or a surface to be meshed
    bool is_surface = false;
    std::filesystem::path tree;  // empty: none, exact bounds need no file
    BoundKind bounds = BoundKind::exact;
    double margin = 0;
    Placement placement;
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s
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

/// A scene as its JSON text says it, paths made absolute or relative to the working directory; nothing is
/// loaded yet.
struct SceneSpec {
    std::vector<SceneBody> bodies;
    std::vector<SceneObstacle> obstacles;
    Eigen::Vector3d gravity{0, 0, -9.81};
    ContactConfig contact;
    SceneTime time;
    std::uint64_t seed = 0;  // carried into recordings
};

/// Reads a scene. All keys but `bodies` may be left out; assets/scenes/scene.schema.json lists them for
/// editors, the defaults are those of the structs above:
///
///     {"bodies": [{"body": "ring.h5"              a body file, or "surface": "ring.obj" to be meshed
///                  "name": "ring", "tree": "ring_tree.h5", "bounds": "exact" | "bd" | "modal",
///                  "margin": 0.02,                relative, of the tree's spheres
///                  "transform": {"translate": [x, y, z], "rotate": {"axis": [x, y, z], "degrees": d},
///                                "scale": s},
///                  "velocity": [x, y, z],
///                  "material": {"young", "poisson", "density", "rayleigh_mass", "rayleigh_stiffness"},
///                  "pins": [REGION, ...],
///                  "grips": [{"region": REGION, "centre": [x, y, z], "translate": [x, y, z],
///                             "rotate": {"axis", "degrees"}, "start", "duration", "release"}]}],
///      "obstacles": [{"plane": {"point", "normal"}} | {"sphere": {"centre", "radius"}} |
///                    {"mesh": {"file", "transform"}}, each with "velocity" and "friction"],
///      "gravity": [x, y, z],
///      "contact": {"stiffness_scale", "friction", "thickness", "damping"},
///      "time": {"dt", "frames", "steps_per_frame"}, "seed": 0}
///
/// REGION is {"box": {"min", "max"}} or {"sphere": {"centre", "radius"}}, world coordinates at time 0.
/// base: folder that relative paths start from. Throws std::invalid_argument, one line: a syntax error with
/// line and column; a wrong type, a number out of range or an unknown key with its JSON path, what was
/// allowed, and the nearest known key.
SceneSpec parse_scene(std::string_view text, const std::filesystem::path& base);

/// Reads the file at `path`. As above; messages start with the path. Throws std::runtime_error where it
/// cannot be read.
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

#pragma once

#include <Eigen/Geometry>
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
#include "meshing/body/rigid_body.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "meshing/surface/subdivide.hpp"
#include "meshing/tets/tetrahedralize.hpp"
#include "sim/json/json_object.hpp"
#include "sim/obstacles/obstacle.hpp"
#include "sim/scene/region.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// x = R (scale X) + translate, where R rotates by `degrees` about `axis`.
struct Placement {
    Eigen::Vector3d translate = Eigen::Vector3d::Zero();
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    double degrees = 0;
    double scale = 1;

    Eigen::Matrix3d rotation() const;
};

struct SceneGrip {
    std::string key;  // "pins[1]", for messages
    Region region;    // at time 0, also of nodes that are taken later
    Grip grip;        // without nodes
};

/// A load on a body, on the part of it in a region, or in a cavity of its surface.
struct SceneLoad {
    std::string key;                 // "loads[1]", for messages
    std::optional<Region> region{};  // none: the whole body
    std::optional<int> cavity{};     // number of it; none: not in one
    BodyLoad load;                   // without what it acts on
    std::vector<Eigen::Vector3d>
        along{};  // of a muscle: a line of points that its fibres go along, at time 0
};

/// A part of a body's surface with a friction of its own.
struct SceneFriction {
    std::string key;                 // "friction[1]", for messages
    std::optional<Region> region{};  // none: the whole surface
    double coefficient = 0;          // Coulomb's
};

/// Tetrahedra of a body with a material of their own.
struct SceneMaterialRegion {
    std::string key;  // "regions[1]", for messages
    Region where;
    MaterialChange material;  // without damping, which is the body's
};

/// Source of a body.
enum class BodySource {
    body,     // a body file
    surface,  // a closed surface to fill with tetrahedra
    tets,     // tetrahedra made by another program
};

/// What bending_error() a body of a surface has at most where nothing is said of its tetrahedra.
inline constexpr double usual_bending_error = 0.03;

/// Settings for filling a surface and refining the collision surface.
struct SceneMeshing {
    TetrahedralizeConfig tets;
    /// Of a surface: the bending_error() to which quadratic tetrahedra are searched for; 0: none are. Empty:
    /// see error_to_search_for().
    std::optional<double> error{};
    double edge = 0;                     // of tetrahedra at the surface, metres; 0: the surface's own
    std::optional<Elements> elements{};  // empty: as in the file; linear ones in a surface
    bool rigid = false;                  // see make_rigid_body()
    double scale = 1;                    // of the file's coordinates, which its units are part of
    Eigen::Vector3d stretch = Eigen::Vector3d::Ones();  // further factors along x, y and z
    double weld = 0;                                    // metres, see weld_within(); 0: not
    int levels = 0;                                     // subdivision levels
    SubdivisionScheme scheme = SubdivisionScheme::midpoint;

    /// `error`; without it usual_bending_error where nothing is said of the tetrahedra of a surface, else 0.
    double error_to_search_for() const noexcept {
        const bool is_told =
            tets.nodes > 0 || tets.grading != TetrahedralizeConfig{}.grading || edge > 0 || elements;
        return error.value_or(is_told ? 0 : usual_bending_error);
    }
    /// Positions of the file in metres, scaled and stretched. X: [n, 3].
    Nodes sized(const Nodes& X) const { return X * (scale * stretch).asDiagonal(); }
};

struct SceneBody {
    std::string name;
    BodySource source = BodySource::body;
    std::filesystem::path file;
    SceneMeshing meshing;
    std::filesystem::path tree;  // empty: no file; exact bounds need none
    BoundKind bounds = BoundKind::automatic;
    std::optional<double> margin;  // relative margin of the spheres; nullopt: as calibrated in the tree
    Placement placement;
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          // m/s
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  // rad/s, about the centre of mass
    MaterialChange material;  // outside of the body's regions; its damping holds in these too
    // Of a rigid body; its centre in the coordinates of the body, before `placement`.
    std::optional<RigidInertia> inertia{};
    std::vector<SceneMaterialRegion> regions;
    std::vector<SceneGrip> grips;
    std::vector<SceneLoad> loads;
    std::vector<SceneFriction> friction{};  // of two for one vertex the later one holds
};

/// Heights over a grid that a file has: a grey image, or a table of numbers.
struct SceneHeights {
    std::string key;  // "heights.file", for messages
    std::filesystem::path file;
    std::optional<double> spacing{};  // of the grid, metres; none: as `size` says
    Eigen::Vector2d size{1, 1};       // of the whole along x and y, metres
    double lowest = 0, highest = 1;   // of black and white in an image, metres

    /// The surface over the grid. Throws std::invalid_argument, the key first, for a file that cannot be
    /// used.
    TriMesh mesh() const;
};

/// A recording that an obstacle deforms by.
struct SurfaceRecording {
    std::filesystem::path file, body;  // the recording, and the body file of what it recorded
    int trajectory = 0;                // its id
    double start = 0, speed = 1;       // it is at its time 0 then, seconds; seconds of it in a second
};

struct SceneObstacle {
    std::string name;   // "obstacles[1]" where the scene gives none
    Obstacle obstacle;  // a mesh's shape is null until make_obstacle()
    std::optional<SurfaceRecording> recording{};
    // As loaded from it, with the times of the scene, and then `made` has its surface; null: not loaded
    std::shared_ptr<const SurfaceFrames> frames{};
    std::filesystem::path mesh;  // empty: no file
    TriMesh made{};              // without faces: neither made by the reader nor loaded
    std::optional<SceneHeights> heights{};
    Placement placement;  // of the mesh
};

/// A rule for two of the scene's bodies, or for a body and an obstacle.
struct ScenePair {
    std::string key;   // "contact.pairs[1]", for messages
    int a = 0, b = 0;  // as PairRules::set() has them
    PairRule rule;
};

struct SceneJoint {
    std::string key;                 // "joints[1]", for messages
    Joint joint;                     // a weld's places are those in `region`
    std::optional<Region> region{};  // of a weld: nodes of the first body, or vertices of a rigid one
    int tendon = -1;                 // of SceneSpec::tendons that it is a part of; -1: none
};

struct SceneTime {
    double dt = 5e-3;  // step length, seconds
    int frames = 100;
    int steps_per_frame = 2;
    // Balance instead of motion; dt is the share of the load that a frame adds, then.
    std::optional<StaticConfig> statics{};

    /// So many frames, of a static scene with as much of its load together.
    void set_frames(int count) noexcept {
        frames = count;
        if (statics) dt = 1.0 / count;
    }
};

/// Output files of a run; an empty path is not written. The recording is relative to the working directory,
/// the others are relative to the recording's folder.
struct SceneOutput {
    std::filesystem::path recording, csv, reactions, vtu, obj, picture;
};

/// A scene as described by its JSON text, with paths joined to the base folder. Nothing is loaded yet.
struct SceneSpec {
    std::string text;  // the text as read, without its comments
    // What all positions are counted from, metres; empty: zero, as in the text. See local_scene().
    std::optional<Eigen::Vector3d> origin{};
    std::vector<SceneBody> bodies;
    std::vector<SceneObstacle> obstacles;
    std::vector<SceneJoint> joints{};
    std::vector<Tendon> tendons{};         // of given lengths, without their parts, see SceneJoint::tendon
    Eigen::Vector3d gravity{0, 0, -9.81};  // the first one of gravity_keys if there are any
    Keyed<Eigen::Vector3d> gravity_keys;
    ContactConfig contact;
    std::vector<ScenePair> pairs;
    bool resolve_start = false;  // whether bodies that intersect at the start are moved apart
    StepConfig step;
    SceneTime time;
    SceneOutput output;
    std::uint64_t seed = 0;  // stored in recordings
};

/// A scene and all problems of its text.
struct SceneReading {
    SceneSpec spec;  // defaults replace wrong values
    std::vector<std::string> problems;
    std::vector<bool> body_is_good, obstacle_is_good;  // one per body and obstacle: nothing in it is wrong
    std::vector<JsonField> fields;                     // every key that was asked for
};

/// Reads a scene. All keys except `bodies` are optional: assets/scenes/README.md explains them,
/// assets/scenes/schema/scene.schema.json lists them for editors, and the structs above give the defaults.
/// base: folder of relative paths. Throws std::invalid_argument, one line, for the first problem: a syntax
/// error with line and column; a duplicate key, a wrong type, a number out of range or an unknown key with
/// its JSON path, what was allowed, and the nearest known key.
SceneSpec parse_scene(std::string_view text, const std::filesystem::path& base);

/// Like parse_scene(), but continues after a problem. Throws only if the text is not JSON or has a duplicate
/// key.
SceneReading read_scene(std::string_view text, const std::filesystem::path& base);

/// file_text() and parse_scene() of the file at `path`; messages start with the path.
SceneSpec load_scene(const std::filesystem::path& path);

/// The loaded data of a scene's body. Bodies that refer to the same data share what is made of it.
struct LoadedBody {
    std::shared_ptr<const Body> body;           // null: it could not be loaded, and checks skip it
    std::shared_ptr<const CollisionTree> tree;  // from a tree file; null: none
};

/// The tree that a scene's body has in build_world(): the loaded one, or one with exact bounds; with `affine`
/// bounds, which hang on the body's own nodes, if the scene asks for them, or for `auto` and the weights
/// allow them. Throws std::invalid_argument if it asks for bounds that need a tree file and there is none, or
/// the body's weights cannot bound.
std::shared_ptr<const CollisionTree> scene_tree(const SceneBody& spec, const LoadedBody& loaded);

/// Gives each body the tree that scene_tree() makes for it, so that several worlds of the scene share them.
/// Bodies of the same data share one. Throws like scene_tree().
void make_trees(const SceneSpec& spec, std::span<LoadedBody> bodies);

/// The scene with all its positions counted from an origin, and with the surfaces that its regions are near
/// to. The origin is zero, unless its bodies lie so far away that
/// float32 would be too coarse for them, see far_origin(). SceneSpec::origin tells it; a scene that has one
/// is returned as it is. bodies: one per spec.bodies. wanted: the origin, where it is known.
SceneSpec local_scene(SceneSpec spec, std::span<const LoadedBody> bodies,
                      std::optional<Eigen::Vector3d> wanted = std::nullopt);

/// Builds the world of a scene. bodies: one per spec.bodies, in that order, as loaded from their files;
/// materials and placements of the scene are applied here, and bodies that intersect are moved apart if the
/// scene asks for it. Positions of the world are those of local_scene(), counted from World::origin(). moves:
/// out, how; not null: bodies that only touch are moved, too, see World::part_touching(). Reads the meshes of
/// obstacles. Throws a one-line std::invalid_argument or std::runtime_error for inconsistent data: a wrong
/// count, a tree of another surface, learned bounds with a scale or without a tree, a region without nodes,
/// an unusable mesh.
World build_world(const SceneSpec& spec, std::span<const LoadedBody> bodies,
                  std::vector<StartMove>* moves = nullptr);

}  // namespace nbd

#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sim/scene/scene.hpp"

// Parts of build_world() and check_scene().
namespace nbd {

/// The grip with the nodes in its region. Throws std::invalid_argument, with the grip's JSON path, where
/// there are none, or as parts_in().
Grip take_nodes(const SceneGrip& from, const PlacedBody& placed);

/// The load on the part of a body in its region. turn: the rotation of its placement. Throws
/// std::invalid_argument, with the load's JSON path, for a region without what the load acts on, or as
/// parts_in(), and for what is not done to a rigid body.
BodyLoad take_part(const SceneLoad& from, const PlacedBody& placed, const Eigen::Matrix3d& turn);

/// Positions of a body's nodes or vertices X, [n, 3], where the scene places them.
Nodes placed(const Nodes& X, const Placement& placement);

/// The materials of a body.
struct BodyMaterials {
    Material material;
    std::vector<MaterialRegion> regions;
    std::optional<RigidInertia> inertia{};  // of a rigid body that is told its own, at its place and size
    bool operator==(const BodyMaterials&) const = default;
};

/// The body's materials, with what the scene changes. Regions of the body with its own material follow the
/// scene's. A tetrahedron in several regions of the scene is of the last. Throws std::invalid_argument, with
/// the region's JSON path, for a region without tetrahedra and for a group that the body does not have.
BodyMaterials scene_materials(const SceneBody& spec, const LoadedBody& loaded);

/// The elastic model of a body at its scale. Throws std::invalid_argument for inconsistent data.
std::shared_ptr<const ElasticBody> scene_elastic(const SceneBody& spec, const LoadedBody& loaded,
                                                 const BodyMaterials& materials);

/// Makes a body for a world: placed, with its velocities, grips and loads. elastic: from scene_elastic().
/// Throws std::invalid_argument for inconsistent data; a message about a grip or a load starts with its JSON
/// path.
WorldBody make_world_body(const SceneBody& spec, const LoadedBody& loaded,
                          std::shared_ptr<const ElasticBody> elastic);

/// Coulomb's coefficient of each surface vertex, as WorldBody has it. Throws std::invalid_argument, with the
/// JSON path, for a region without vertices, or as parts_in().
std::vector<double> surface_friction(const SceneBody& spec, const PlacedBody& placed);

/// Throws std::invalid_argument, with the load's JSON path, for a load on what grips hold for ever. body:
/// with the scene's loads and its grips.
void check_loads(const SceneBody& spec, const WorldBody& body);

/// The faces of the cavity that a load is in; of a load in none, those of no cavity, or none where all are.
/// x: the surface's vertices. Throws std::invalid_argument, with the load's JSON path, for a cavity that
/// there is not.
std::vector<int> faces_at(const SceneLoad& load, NodesRef x, const Faces& F);

/// Throws std::invalid_argument, with the load's JSON path, if load k is a gas in a rigid body, or in a
/// cavity that has one.
void check_gas_load(const SceneBody& spec, const WorldBody& body, std::size_t k);

/// What is wrong with a grip that holds nodes of another one at a time, seconds. Both by their keys.
std::string at_odds_text(const std::string& grip, const std::string& other, double time);

/// Adds the joint, with the places of a weld. body: the first one. Throws std::invalid_argument, its JSON
/// path first, for what the world refuses, where the region of a weld holds no places, and as parts_in().
void add_joint(const SceneJoint& spec, World& world, const Body& body);

/// Makes an obstacle; reads its mesh if it has one, and turns its faces outward where they are not, with a
/// notice(). Throws std::invalid_argument or std::runtime_error if the mesh cannot be used.
Obstacle make_obstacle(const SceneObstacle& spec);

}  // namespace nbd

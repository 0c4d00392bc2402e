#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "meshing/body/body.hpp"
#include "sim/obstacles/obstacle.hpp"

namespace nbd {

/// What lies within a distance of a straight line between two points.
struct CapsuleShape {
    Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
    double radius = 1;  // metres, > 0
};

/// What lies within a distance of the surface of a body or an obstacle as it is at time 0, on either side.
struct NearSurface {
    std::string key;                    // "bodies[0].pins[1].near", for messages
    std::string body, obstacle;         // the name of one of them
    double distance = 0;                // metres, > 0
    std::optional<Obstacle> surface{};  // none: local_scene() has not found it
};

/// A group that the body's file names: of tetrahedra, or of faces of its surface.
struct NamedGroup {
    std::string name;
};

/// Rows of the body's nodes.
struct NodeList {
    std::vector<int> rows;
};

/// Rows of the faces of the body's surface.
struct FaceList {
    std::vector<int> rows;
};

/// How a region is made of others.
enum class Combination {
    all,   // what lies in all of them
    any,   // in one of them or more
    none,  // in none of them
};

/// A part of a body: what lies in a part of space at time 0, or what its file names.
struct Region {
    std::variant<Eigen::AlignedBox3d, BallShape, CapsuleShape, NearSurface, NamedGroup, NodeList, FaceList,
                 Combination>
        part{};
    std::vector<Region> of{};  // of a combination
};

/// Moves what a region says of space itself, without the regions that it is made of.
void move(Region& region, const Eigen::Vector3d& by);

/// A body as it is placed in a scene.
struct PlacedBody {
    const Body& body;
    const Nodes& x;  // [N, 3] metres, of its nodes
};

enum class BodyPart { node, vertex, face, tet };

/// The rows of what is in a region, ascending. Of space: nodes and vertices that lie in it, faces whose three
/// vertices do, tetrahedra whose centres do. Of a group or list of faces: their vertices, and the nodes that
/// carry these; it has no tetrahedra. Of a group of tetrahedra or a list of nodes: its nodes, the vertices
/// that hang on these alone, faces of three such vertices, and tetrahedra of four such corners. Where a group
/// of tetrahedra and one of faces have one name, vertices and faces are of the latter. key: for messages.
/// Throws std::invalid_argument, starting with the key, for a group that the body does not have, a row out of
/// range, and tetrahedra of faces.
std::vector<int> parts_in(const std::string& key, const Region& region, BodyPart part,
                          const PlacedBody& placed);

}  // namespace nbd

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "collision/geometry/embedding.hpp"
#include "collision/geometry/geometry.hpp"
#include "sim/obstacles/obstacle.hpp"

namespace nbd {

/// A number >= 0 at the nodes of a body, in every frame.
struct NodeScalar {
    std::string name, unit;
    std::vector<float> values;  // [frames * N]
};

/// Bounds of the first nodes of a body's tree, in every frame.
struct ViewBounds {
    std::string kind;             // name of a BoundKind
    bool are_boxes = false;       // lo and hi, 6 numbers; else centre and radius, 4 numbers
    std::vector<int> first_node;  // [depths + 1] first node of each depth
    std::vector<float> values;    // [frames * nodes * numbers]
};

/// Faces that a page marks, in every frame, ascending.
struct FaceMarks {
    std::vector<std::uint32_t> counts;  // [frames]
    std::vector<std::uint32_t> faces;   // of all frames
    void add_frame(std::vector<std::uint32_t> marked);
};

/// What a page shows of one body.
struct ViewBody {
    std::string name;
    Faces F;
    SurfaceEmbedding W;  // [n, N] surface vertices from nodes; empty: the nodes are the vertices
    Vertices start;      // [N, 3] pose that displacement is measured from
    Vertices nodes;      // [frames * N, 3], metres
    std::vector<NodeScalar> scalars;
    std::optional<ViewBounds> bounds;
    FaceMarks near;          // within the contact distance of another body, an obstacle or the body itself
    FaceMarks intersecting;  // with a point in common with those
    FaceMarks missed;        // near or intersecting with faces that the bounds do not find
};

/// An obstacle and where it is.
struct ViewObstacle {
    Obstacle obstacle;              // in its own place
    std::vector<Placing> places{};  // [frames]; empty: it is there in all frames
};

/// A force on a body in a frame, and a torque about the point at which it acts.
struct ViewReaction {
    int body = 0;
    Eigen::Vector3f point, force, torque;  // metres, N, N m
};

/// Numbers of face pairs in a frame.
struct PairCounts {
    std::uint32_t intersecting = 0, near = 0, intersecting_missed = 0, near_missed = 0;
};

/// Everything that a page shows. The frames of all bodies are those of `times`.
struct ViewScene {
    std::string title;
    std::string displacement_from;  // "the start" or "rest"
    Eigen::Vector3d up{0, 0, 1};    // unit
    std::vector<double> times;      // [frames] seconds
    std::vector<int> numbers;       // [frames] in the recording
    int recorded_frames = 0;        // in the recording
    std::vector<ViewBody> bodies;
    std::vector<ViewObstacle> obstacles;
    double contact_distance = 0;                         // metres, of `near`
    std::vector<PairCounts> pairs;                       // [frames]; empty: contacts were not sought
    bool is_audited = false;                             // whether `missed` was sought
    bool has_reactions = false;                          // whether they are known
    std::vector<std::vector<ViewReaction>> reactions{};  // [frames] in the last step of each, if they are

    std::size_t frames() const noexcept { return times.size(); }
};

}  // namespace nbd

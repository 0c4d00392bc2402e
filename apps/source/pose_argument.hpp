#pragma once

#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/view/make_view.hpp"
#include "collision/geometry/tet_mesh.hpp"
#include "collision/tree/collision_tree.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// A body in a pose, as the command line names it.
struct PoseArgument {
    std::shared_ptr<const CollisionTree> tree;
    Vertices x;  // [n, 3], counted from `origin`
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    Nodes exact{};           // [n, 3] of a surface file, in double precision, counted from zero
    bool from_tree = false;  // with the bounds of a tree file
    Vertices nodes{};        // [N, 3] that carry the surface; empty if the pose has none
    Vertices rest{};         // [n, 3] of the tree's body at rest; empty without a tree
};

/// Frames of a recording, as the command line names them.
struct RecordedFrames {
    std::string path;
    int trajectory = 0;
    std::optional<int> frame{};  // empty: all
};

/// RECORDING.h5:trajectory or RECORDING.h5:trajectory:frame; empty for any other text.
std::optional<RecordedFrames> recorded_frames(std::string_view text);

/// Index of the trajectory in the recording, which is open. Throws std::runtime_error if it has no such
/// frames, or they are of another body. whose: the body, for the message.
int find_frames(const RecordingReader& recording, const RecordedFrames& frames, const std::string& body_hash,
                std::string_view whose);

/// Reads `SURFACE` (a surface file, with boxes or exact spheres as bounds) or `TREE.h5@POSE`, where POSE is a
/// surface file with the tree's faces or `RECORDING.h5:trajectory:frame`. bounds: those that a tree is to be
/// used with; `affine` needs a recorded pose. Throws std::runtime_error that names the wrong part.
PoseArgument read_pose(const std::string& argument, BoundKind bounds);

/// Counts the surfaces from a common origin, see far_origin(), so that float32 can hold their shapes and
/// places. Returns the origin.
Eigen::Vector3d count_from_common_origin(std::initializer_list<PoseArgument*> surfaces);

/// Throws std::invalid_argument if the bounds need a model, or a margin is given to bounds without radii, and
/// none of the surfaces has a tree file.
void check_model_of(std::initializer_list<const PoseArgument*> surfaces, BoundKind bounds, bool has_margin);

/// The bounds of a surface where `asked` ones are asked for: those, if it has a tree file; otherwise exact
/// ones of the same form, so that spheres meet spheres.
BoundKind bounds_for(const PoseArgument& posed, BoundKind asked);

/// The surface, without its pose, as a page shows it. bounds, margin: of its tree, if it has one; otherwise
/// see bounds_for().
ViewSource view_source(std::string name, const PoseArgument& posed, BoundKind bounds,
                       std::optional<float> margin);

}  // namespace nbd

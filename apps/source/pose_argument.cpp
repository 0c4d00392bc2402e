#include "apps/source/pose_argument.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include "collision/geometry/far_origin.hpp"
#include "meshing/formats/read_surface.hpp"
#include "meshing/formats/words.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {
namespace {

/// Reads the number >= 0 that a text ends with, after a colon, and cuts both off; empty if there is none.
std::optional<int> cut_number(std::string_view& text) {
    const std::size_t colon = text.rfind(':');
    if (colon == std::string_view::npos) return std::nullopt;
    const auto number = plain_number_in<int>(text.substr(colon + 1));
    if (!number || *number < 0) return std::nullopt;
    text = text.substr(0, colon);
    return number;
}

/// nodes: out, [N, 3] of the body. origin: out, what they and the result are counted from.
Vertices recorded_pose(const TreeFile& file, const RecordedFrames& frames, Vertices& nodes,
                       Eigen::Vector3d& origin) {
    const RecordingReader recording(frames.path);
    origin = recording.origin();
    const int trajectory = find_frames(recording, frames, file.facts.body_hash, "the tree's");
    Vertices x;
    recording.read(trajectory, *frames.frame, 1, nodes);
    apply_embedding(file.W, nodes, x);
    return x;
}

Vertices from(const Eigen::Vector3d& origin, const Nodes& x) {
    return (x.rowwise() - origin.transpose()).cast<float>();
}

Nodes surface_pose(const TreeFile& file, const std::string& path) {
    const TriMesh mesh = read_surface(path);
    if (mesh.F.rows() != file.tree.faces.rows() || mesh.F != file.tree.faces)
        throw std::runtime_error(fmt::format("{}: its {} faces are not those of the tree ({})", path,
                                             mesh.F.rows(), file.tree.faces.rows()));
    return mesh.X;
}

/// Throws std::runtime_error unless affine bounds of the tree can take the pose. argument: as the command
/// line names the pose.
void check_affine(const TreeFile& file, const Vertices& nodes, const std::string& argument) {
    if (nodes.rows() == 0)
        throw std::runtime_error(fmt::format(
            "{}: affine bounds need the nodes of a pose; allowed: TREE.h5@RECORDING.h5:trajectory:frame",
            argument));
    if (!file.tree.affine)
        throw std::runtime_error(
            fmt::format("{}: the tree has no rest positions of its nodes, which affine bounds need; allowed: "
                        "a tree trained on a body with tetrahedra",
                        argument));
}

}  // namespace

std::optional<RecordedFrames> recorded_frames(std::string_view text) {
    const std::optional<int> last = cut_number(text);
    if (!last || text.empty()) return std::nullopt;
    const std::optional<int> first = cut_number(text);
    if (text.empty()) return std::nullopt;
    if (!first) return RecordedFrames{std::string(text), *last, std::nullopt};
    return RecordedFrames{std::string(text), *first, *last};
}

int find_frames(const RecordingReader& recording, const RecordedFrames& frames, const std::string& body_hash,
                std::string_view whose) {
    const auto& trajectories = recording.trajectories();
    const auto found = std::ranges::find(trajectories, frames.trajectory, &TrajectoryInfo::id);
    if (found == trajectories.end())
        throw std::runtime_error(fmt::format("{}: no trajectory {}, it has {}", frames.path,
                                             frames.trajectory, trajectories.size()));
    if (found->body_hash != body_hash)
        throw std::runtime_error(fmt::format("{}: trajectory {} was recorded from another body than {}",
                                             frames.path, frames.trajectory, whose));
    if (frames.frame.value_or(0) >= found->frames)
        throw std::runtime_error(fmt::format("{}: no frame {} in trajectory {}, it has {}", frames.path,
                                             frames.frame.value_or(0), frames.trajectory, found->frames));
    return found - trajectories.begin();
}

PoseArgument read_pose(const std::string& argument, BoundKind bounds) {
    const std::size_t at = argument.find('@');
    if (at == std::string::npos) {
        TriMesh mesh = read_surface(argument);
        const Eigen::Vector3d origin = far_origin(mesh.X, mesh.F);
        Vertices x = from(origin, mesh.X);
        return {.tree = shared_exact_tree(x, mesh.F), .x = x, .origin = origin, .exact = std::move(mesh.X)};
    }
    if (at == 0 || at + 1 == argument.size())
        throw std::invalid_argument(
            fmt::format("'{}': a name is empty; allowed: SURFACE or TREE.h5@POSE", argument));
    TreeFile file = load_tree(argument.substr(0, at));
    const std::string pose = argument.substr(at + 1);
    const std::optional<RecordedFrames> recorded = recorded_frames(pose);
    const bool is_recorded = recorded && recorded->frame;
    Vertices nodes;
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    Nodes exact;
    if (!is_recorded) {
        exact = surface_pose(file, pose);
        origin = far_origin(exact, file.tree.faces);
    }
    Vertices x = is_recorded ? recorded_pose(file, *recorded, nodes, origin) : from(origin, exact);
    if (bounds == BoundKind::affine) check_affine(file, nodes, argument);
    return {.tree = std::make_shared<const CollisionTree>(std::move(file.tree)),
            .x = std::move(x),
            .origin = origin,
            .exact = std::move(exact),
            .from_tree = true,
            .nodes = std::move(nodes),
            .rest = std::move(file.X)};
}

Eigen::Vector3d count_from_common_origin(std::initializer_list<PoseArgument*> surfaces) {
    const auto in_double = [](const PoseArgument& s) {
        if (s.exact.rows() > 0) return s.exact;
        return Nodes(s.x.cast<double>().rowwise() + s.origin.transpose());
    };
    Eigen::AlignedBox3d box;
    double edge = std::numeric_limits<double>::infinity();
    for (const PoseArgument* surface : surfaces) {
        const Nodes x = in_double(*surface);
        for (Eigen::Index v = 0; v < x.rows(); ++v) box.extend(x.row(v).transpose());
        edge = std::min(edge, mean_edge(x, surface->tree->faces));
    }
    const Eigen::Vector3d origin = far_origin(box, edge);
    for (PoseArgument* surface : surfaces) {
        if (surface->origin == origin) continue;
        surface->x = from(origin, in_double(*surface));
        if (surface->nodes.rows() > 0)
            surface->nodes =
                from(origin, surface->nodes.cast<double>().rowwise() + surface->origin.transpose());
        surface->origin = origin;
    }
    return origin;
}

void check_model_of(std::initializer_list<const PoseArgument*> surfaces, BoundKind bounds, bool has_margin) {
    if (std::ranges::any_of(surfaces, &PoseArgument::from_tree)) return;
    if (bounds != BoundKind::automatic && !is_exact(bounds))
        throw std::invalid_argument(
            fmt::format("--bounds: a surface file does not have {} bounds; allowed: exact, boxes, auto, "
                        "or TREE.h5@POSE instead of the file",
                        name(bounds)));
    if (has_margin && bounds != BoundKind::exact)
        throw std::invalid_argument(
            "--margin: boxes of a surface file take none; allowed: with --bounds exact, "
            "or TREE.h5@POSE instead of the file");
}

BoundKind bounds_for(const PoseArgument& posed, BoundKind asked) {
    if (posed.from_tree) return asked;
    return is_box(asked) ? BoundKind::boxes : BoundKind::exact;
}

ViewSource view_source(std::string name, const PoseArgument& posed, BoundKind bounds,
                       std::optional<float> margin) {
    return {.name = std::move(name),
            .tree = {.tree = posed.tree, .bounds = bounds_for(posed, bounds), .margin = margin},
            .start = posed.rest};
}

}  // namespace nbd

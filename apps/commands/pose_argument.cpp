#include "apps/commands/pose_argument.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <stdexcept>

#include "collision/bounds/certified/solid_meter.hpp"
#include "meshing/formats/read_surface.hpp"
#include "training/files/recording.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {
namespace {

/// A frame of a recording, as the command line names it.
struct RecordedFrame {
    std::string path;
    int trajectory = 0, frame = 0;
};

/// Reads digits that a text ends with, after a colon, and cuts both off; empty if there are none or too many.
std::optional<int> cut_number(std::string_view& text) {
    const std::size_t colon = text.rfind(':');
    if (colon == std::string_view::npos) return std::nullopt;
    const std::string_view digits = text.substr(colon + 1);
    int number = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (digits.empty() || digits.front() == '-' || error != std::errc() ||
        end != digits.data() + digits.size())
        return std::nullopt;
    text = text.substr(0, colon);
    return number;
}

/// RECORDING.h5:trajectory:frame; empty for any other text.
std::optional<RecordedFrame> recorded_frame(std::string_view text) {
    const std::optional<int> frame = cut_number(text);
    if (!frame) return std::nullopt;
    const std::optional<int> trajectory = cut_number(text);
    if (!trajectory || text.empty()) return std::nullopt;
    return RecordedFrame{std::string(text), *trajectory, *frame};
}

/// nodes: out, [N, 3] of the body.
Vertices recorded_pose(const TreeFile& file, const std::string& path, int id, int frame, Vertices& nodes) {
    const RecordingReader recording(path);
    const auto& trajectories = recording.trajectories();
    const auto found = std::ranges::find(trajectories, id, &TrajectoryInfo::id);
    if (found == trajectories.end())
        throw std::runtime_error(
            fmt::format("{}: no trajectory {}, it has {}", path, id, trajectories.size()));
    if (found->body_hash != file.facts.body_hash)
        throw std::runtime_error(
            fmt::format("{}: trajectory {} was recorded from another body than the tree's", path, id));
    if (frame >= found->frames)
        throw std::runtime_error(
            fmt::format("{}: no frame {} in trajectory {}, it has {}", path, frame, id, found->frames));
    Vertices x;
    recording.read(static_cast<int>(found - trajectories.begin()), frame, 1, nodes);
    apply_embedding(file.W, nodes, x);
    return x;
}

Vertices surface_pose(const TreeFile& file, const std::string& path) {
    const TriMesh mesh = read_surface(path);
    if (mesh.F.rows() != file.tree.faces.rows() || mesh.F != file.tree.faces)
        throw std::runtime_error(fmt::format("{}: its {} faces are not those of the tree ({})", path,
                                             mesh.F.rows(), file.tree.faces.rows()));
    return mesh.X.cast<float>();
}

/// Gives the tree of a file affine bounds if it has none. argument: as the command line names the pose.
void prepare_affine(TreeFile& file, const Vertices& nodes, const std::string& argument) {
    if (nodes.rows() == 0)
        throw std::runtime_error(fmt::format(
            "{}: affine bounds need the nodes of a pose; allowed: TREE.h5@RECORDING.h5:trajectory:frame",
            argument));
    if (file.tree.affine) return;
    if (file.solid.X.rows() != file.W.cols())  // a tree of an earlier version has them there
        throw std::runtime_error(fmt::format(
            "{}: the tree has no rest positions of its nodes, which affine bounds need; allowed: a tree "
            "trained on a body with tetrahedra",
            argument));
    hang_on_nodes(file.tree, file.W, file.solid.X.cast<float>());
}

}  // namespace

PosedSurface read_pose(const std::string& argument, BoundKind bounds) {
    const std::size_t at = argument.find('@');
    if (at == std::string::npos) {
        const TriMesh mesh = read_surface(argument);
        Vertices x = mesh.X.cast<float>();
        return {shared_exact_tree(x, mesh.F), x, false};
    }
    if (at == 0 || at + 1 == argument.size())
        throw std::invalid_argument(
            fmt::format("'{}': a name is empty; allowed: SURFACE or TREE.h5@POSE", argument));
    TreeFile file = load_tree(argument.substr(0, at));
    const std::string pose = argument.substr(at + 1);
    const std::optional<RecordedFrame> recorded = recorded_frame(pose);
    Vertices nodes;
    std::vector<RegionMotion> motion;
    Vertices x = recorded ? recorded_pose(file, recorded->path, recorded->trajectory, recorded->frame, nodes)
                          : surface_pose(file, pose);
    const bool has_nodes = nodes.rows() > 0 && file.solid.X.rows() == file.W.cols();
    if (bounds == BoundKind::affine || (bounds == BoundKind::automatic && has_nodes))
        prepare_affine(file, nodes, argument);
    if (bounds == BoundKind::certified && file.tree.certified && nodes.rows() > 0) {
        SolidMeter meter(file.solid, std::make_shared<const TetRegions>(file.tree.certified->regions));
        const std::span<const RegionMotion> measured = meter.measure(nodes);
        motion.assign(measured.begin(), measured.end());
    }
    return {std::make_shared<const CollisionTree>(std::move(file.tree)), std::move(x), true, std::move(nodes),
            std::move(motion)};
}

}  // namespace nbd

#include "apps/check/check_file.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <optional>
#include <span>
#include <stdexcept>

#include "apps/check/check_dataset.hpp"
#include "apps/check/check_recording.hpp"
#include "collision/flat/flat_file.hpp"
#include "collision/flat/flat_tree.hpp"
#include "meshing/h5/inspect.hpp"
#include "meshing/h5/reader.hpp"
#include "meshing/surface/counted.hpp"
#include "training/files/dataset_manifest.hpp"
#include "training/files/recording_format.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {
namespace {

void refuse_body(const std::filesystem::path& path, const std::string& hash, const CheckedBody& body) {
    if (hash != body.hash)
        throw std::runtime_error(fmt::format("{}: is of body {}; allowed: {}, which is {}", path.string(),
                                             hash, body.hash, body.file));
}

/// "recording: " or "dataset: ", and what was checked.
std::string check_recording_file(const std::filesystem::path& path, const CheckedBody* body) {
    const RecordingReader recording(path);
    check_recording(recording, body);
    std::string checked = fmt::format("{} of {}", counted_trajectories(recording.trajectories().size()),
                                      counted(recording.frames(), "frame"));
    if (h5::Reader(path).format().version < view_format.version) return "recording: " + checked;
    check_dataset(recording);
    const DatasetManifest manifest = read_dataset_manifest(path);
    return fmt::format("dataset: {}, {}, {}", checked, counted(manifest.shards.size(), "shard"),
                       counted(1 + manifest.splits.size(), "split"));
}

std::string check_container(const std::filesystem::path& path, const CheckedBody* body) {
    const std::string format = h5::Reader(path).format().name;
    std::string checked;
    if (format == "nbdtree body") {
        const Body own = load_body(path);
        if (body) refuse_body(path, body_hash(own), *body);
        checked = fmt::format("body: {} of {}", counted(own.tets.T.rows(), "tetrahedron", "tetrahedra"),
                              counted(own.tets.X.rows(), "node"));
    } else if (format == "nbdtree recording") {
        checked = check_recording_file(path, body);
    } else if (format == "nbdtree tree") {
        const TreeFile tree = load_tree(path);
        if (body) refuse_body(path, tree.facts.body_hash, *body);
        checked = "tree: " + counted(tree.tree.spheres.nodes.size(), "node");
    } else {
        throw std::runtime_error(fmt::format(
            "{}: is a file of format '{}'; allowed: nbdtree body, nbdtree recording, nbdtree tree",
            path.string(), format));
    }
    h5::inspect(path);  // every checksum, also of what is not read above
    return fmt::format("{}: no defect found in this {}", path.string(), checked);
}

}  // namespace

bool begins_as_flat_tree(const std::filesystem::path& path) {
    std::array<char, FlatHeader::known_magic.size()> beginning{};
    std::ifstream(path, std::ios::binary).read(beginning.data(), beginning.size());
    return is_flat_file(std::as_bytes(std::span(beginning)));
}

std::string check_file(const std::filesystem::path& path, const std::filesystem::path& body_file) {
    std::optional<CheckedBody> body;
    if (!body_file.empty()) {
        body.emplace(CheckedBody{load_body(body_file), {}, body_file.string()});
        body->hash = body_hash(body->body);
    }
    if (!begins_as_flat_tree(path)) return check_container(path, body ? &*body : nullptr);
    const CollisionTree tree = load_flat_tree(path);
    if (body && (tree.vertex_count != body->body.surface.X.rows() || tree.faces != body->body.surface.F))
        throw std::runtime_error(
            fmt::format("{}: is of another surface; allowed: that of {}", path.string(), body->file));
    return fmt::format("{}: no defect found in this flat tree: {}", path.string(),
                       counted(tree.spheres.nodes.size(), "node"));
}

}  // namespace nbd

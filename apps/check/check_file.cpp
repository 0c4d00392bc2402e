#include "apps/check/check_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <vector>

#include "collision/flat/flat_file.hpp"
#include "collision/flat/flat_tree.hpp"
#include "meshing/body/body.hpp"
#include "meshing/h5/inspect.hpp"
#include "meshing/h5/reader.hpp"
#include "meshing/surface/counted.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "training/files/recording_format.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {
namespace {

/// A body that recordings are checked against.
struct CheckedBody {
    Body body;
    std::string hash;  // body_hash()
    std::string file;  // for messages
};

class RecordingCheck {
 public:
    RecordingCheck(const RecordingReader& recording, const CheckedBody* body)
        : recording_(recording), body_(body) {
        for (const TrajectoryInfo& info : recording.trajectories()) ids_.insert(info.id);
    }

    void run() const {
        check_names();
        for (int i = 0; i < std::ssize(recording_.trajectories()); ++i) {
            if (body_) check_body(i);
            check_frames(i);
        }
    }

 private:
    template <class... Args>
    [[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) const {
        throw std::runtime_error(fmt::format("{}: {}", recording_.path().string(),
                                             fmt::format(format, std::forward<Args>(args)...)));
    }

    void check_names() const {
        const h5::Reader file(recording_.path());
        std::set<std::string> hashes;
        for (const std::string& name : file.children("trajectories")) {
            const std::string group = "trajectories/" + name;
            const auto id = file.attribute<int>(group, "id");
            if (group != trajectory_group(id))
                refuse("group '{}' has trajectory {}; allowed: the trajectory of its name", group, id);
            hashes.insert(file.attribute<std::string>(group, "body_sha256"));
        }
        if (file.format().version > recording_format.version || hashes.empty()) return;
        const std::string is = file.attribute<std::string>("/", "body_sha256"),
                          wanted = hashes.size() == 1 ? *hashes.begin() : "several";
        if (is != wanted)
            refuse("body_sha256 of the file is {}, of its trajectories {}; allowed: the same", is, wanted);
    }

    void check_body(int i) const {
        const TrajectoryInfo& info = recording_.trajectories()[i];
        const auto nodes = body_->body.tets.X.rows(), points = corner_tets(body_->body.tets).rows();
        if (info.body_hash != body_->hash)
            refuse("trajectory {} is of body {}; allowed: {}, which is {}", info.id, info.body_hash,
                   body_->hash, body_->file);
        if (recording_.nodes(i) != nodes)
            refuse("trajectory {} has {} nodes; allowed: {}, as in {}", info.id, recording_.nodes(i), nodes,
                   body_->file);
        if (const int has = recording_.contents(i).tets; has != 0 && has != points)
            refuse("trajectory {} has stresses at {} points; allowed: {}, as in {}", info.id, has, points,
                   body_->file);
    }

    void check_frames(int i) const {
        constexpr int frames_at_once = 16;
        const TrajectoryInfo& info = recording_.trajectories()[i];
        Vertices x;
        for (int begin = 0; begin < info.frames; begin += frames_at_once) {
            const int count = std::min(frames_at_once, info.frames - begin);
            recording_.read(i, begin, count, x);
            const std::vector<FrameExtras> extras = recording_.read_extras(i, begin, count);
            for (int k = 0; k < count; ++k)
                for (const ContactEdge& edge : extras[k].contact_edges) check_edge(info, begin + k, edge);
        }
    }

    void check_edge(const TrajectoryInfo& info, int frame, const ContactEdge& edge) const {
        const auto& [face, partner, other] = edge;
        if (partner >= 0 && !ids_.contains(partner))
            refuse(
                "frame {} of trajectory {} has the contact edge ({}, {}, {}); allowed: "
                "trajectories of the file",
                frame, info.id, face, partner, other);
        if (!body_) return;
        const int faces = body_->body.surface.F.rows();
        if (face >= faces || other >= faces)
            refuse("frame {} of trajectory {} has the contact edge ({}, {}, {}); allowed: faces 0 to {}",
                   frame, info.id, face, partner, other, faces - 1);
    }

    const RecordingReader& recording_;
    const CheckedBody* body_;
    std::set<int> ids_;
};

/// Checks what a recording holds: every frame is read, groups have the names of their ids, contact edges
/// refer to trajectories of the file and to faces. body: null, or the body that all trajectories must be of.
/// Throws std::runtime_error, one line with the path of the file.
void check_recording(const RecordingReader& recording, const CheckedBody* body) {
    RecordingCheck(recording, body).run();
}

void refuse_body(const std::filesystem::path& path, const std::string& hash, const CheckedBody& body) {
    if (hash != body.hash)
        throw std::runtime_error(fmt::format("{}: is of body {}; allowed: {}, which is {}", path.string(),
                                             hash, body.hash, body.file));
}

/// "recording: " or "dataset: ", and what was checked.
std::string check_recording_file(const std::filesystem::path& path, const CheckedBody* body) {
    const RecordingReader recording(path);
    check_recording(recording, body);
    recording.reactions();
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

#include "apps/check/check_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <vector>

#include "meshing/h5/reader.hpp"
#include "training/files/recording_format.hpp"

namespace nbd {
namespace {

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
            const auto id = static_cast<int>(file.int_attribute(group, "id"));
            if (group != trajectory_group(id))
                refuse("group '{}' has trajectory {}; allowed: the trajectory of its name", group, id);
            hashes.insert(file.text_attribute(group, "body_sha256"));
        }
        if (file.format().version > recording_format.version || hashes.empty()) return;
        const std::string is = file.text_attribute("/", "body_sha256"),
                          wanted = hashes.size() == 1 ? *hashes.begin() : "several";
        if (is != wanted)
            refuse("body_sha256 of the file is {}, of its trajectories {}; allowed: the same", is, wanted);
    }

    void check_body(int i) const {
        const TrajectoryInfo& info = recording_.trajectories()[i];
        const auto nodes = body_->body.tets.X.rows(), tets = body_->body.tets.T.rows();
        if (info.body_hash != body_->hash)
            refuse("trajectory {} is of body {}; allowed: {}, which is {}", info.id, info.body_hash,
                   body_->hash, body_->file);
        if (recording_.nodes(i) != nodes)
            refuse("trajectory {} has {} nodes; allowed: {}, as in {}", info.id, recording_.nodes(i), nodes,
                   body_->file);
        if (const int has = recording_.contents(i).tets; has != 0 && has != tets)
            refuse("trajectory {} has {} tetrahedra; allowed: {}, as in {}", info.id, has, tets, body_->file);
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
                "frame {} of trajectory {} has the contact edge ({}, {}, {}); "
                "allowed: trajectories of the file",
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

}  // namespace

void check_recording(const RecordingReader& recording, const CheckedBody* body) {
    RecordingCheck(recording, body).run();
}

}  // namespace nbd

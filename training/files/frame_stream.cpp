#include "training/files/frame_stream.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace nbd {

void for_each_frame(const SurfaceBody& body, const RecordingReader& recording,
                    std::span<const FrameId> frames, const FrameVisitor& visit) {
    FrameSource(body.W, recording, 0).for_each_frame(frames, visit);
}

void for_each_pose(const SurfaceBody& body, const RecordingReader& recording, std::span<const FrameId> frames,
                   const PoseVisitor& visit) {
    FrameSource(body.W, recording, 0).for_each_pose(frames, visit);
}

void check_recording(std::string_view body_hash, Eigen::Index nodes, const RecordingReader& recording) {
    const auto& infos = recording.trajectories();
    for (std::size_t i = 0; i < infos.size(); ++i) {
        if (infos[i].body_hash != body_hash)
            throw std::runtime_error(
                fmt::format("{}: trajectory {} is of body {:.12}, but this body is {:.12}",
                            recording.path().string(), infos[i].id, infos[i].body_hash, body_hash));
        const int recorded = recording.nodes(i);
        if (recorded != nodes)
            throw std::runtime_error(fmt::format("{}: trajectory {} has {} nodes, but the body has {}",
                                                 recording.path().string(), infos[i].id, recorded, nodes));
    }
}

void check_recording(const SurfaceBody& body, const RecordingReader& recording) {
    check_recording(body.hash, body.W.cols(), recording);
}

}  // namespace nbd

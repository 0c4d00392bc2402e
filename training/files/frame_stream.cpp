#include "training/files/frame_stream.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <vector>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {

namespace {

constexpr int window = 128;  // frames read at once, of which a sparse list uses a few

/// Length of the next batch: frames of one trajectory within one window, one a slot.
int batch_size(std::span<const FrameId> frames) {
    std::size_t count = 1;
    while (count < frames.size() && count < frame_slots && frames[count].trajectory == frames[0].trajectory &&
           frames[count].frame < frames[0].frame + window)
        ++count;
    return static_cast<int>(count);
}

}  // namespace

void for_each_frame(const SurfaceBody& body, const RecordingReader& recording,
                    std::span<const FrameId> frames, const FrameVisitor& visit) {
    for_each_pose(body, recording, frames,
                  [&](int slot, int index, VerticesRef x, VerticesRef) { visit(slot, index, x); });
}

void for_each_pose(const SurfaceBody& body, const RecordingReader& recording, std::span<const FrameId> frames,
                   const PoseVisitor& visit) {
    std::vector<Vertices> surfaces(frame_slots);
    Vertices nodes;
    int index = 0;
    while (!frames.empty()) {
        const int count = batch_size(frames);
        const auto batch = frames.first(static_cast<std::size_t>(count));
        const int begin = batch.front().frame;
        recording.read(batch.front().trajectory, begin, batch.back().frame - begin + 1, nodes);
        parallel_for(
            count,
            [&](int slot) {
                const Eigen::Index n = body.W.cols();
                const Eigen::Index row = n * (batch[static_cast<std::size_t>(slot)].frame - begin);
                Vertices& x = surfaces[static_cast<std::size_t>(slot)];
                apply_embedding(body.W, nodes.middleRows(row, n), x);
                visit(slot, index + slot, x, nodes.middleRows(row, n));
            },
            1);
        frames = frames.subspan(static_cast<std::size_t>(count));
        index += count;
    }
}

void check_recording(const SurfaceBody& body, const RecordingReader& recording) {
    const auto& infos = recording.trajectories();
    for (std::size_t i = 0; i < infos.size(); ++i) {
        if (infos[i].body_hash != body.hash)
            throw std::runtime_error(
                fmt::format("{}: trajectory {} is of body {:.12}, but this body is {:.12}",
                            recording.path().string(), infos[i].id, infos[i].body_hash, body.hash));
        const int nodes = recording.nodes(static_cast<int>(i));
        if (nodes != body.W.cols())
            throw std::runtime_error(fmt::format("{}: trajectory {} has {} nodes, but the body has {}",
                                                 recording.path().string(), infos[i].id, nodes,
                                                 body.W.cols()));
    }
}

}  // namespace nbd

#include "training/files/frame_source.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "collision/base/stop.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "meshing/progress/progress.hpp"

namespace nbd {

namespace {

constexpr int window = 128;  // frames read at once; a sparse list uses a few of them

using Rows = Eigen::Map<const Vertices>;

/// Length of the next batch: frames of one trajectory within one window, one a slot.
int batch_size(std::span<const FrameId> frames) {
    std::size_t count = 1;
    while (count < frames.size() && count < frame_slots && frames[count].trajectory == frames[0].trajectory &&
           frames[count].frame < frames[0].frame + window)
        ++count;
    return count;
}

/// The frame's nodes in what was read from frame `begin` on.
Rows rows_of(const Vertices& nodes, Eigen::Index count, int begin, int frame) {
    return {nodes.data() + 3 * count * (frame - begin), count, 3};
}

}  // namespace

std::size_t default_frame_memory() {
    std::size_t bytes =
        static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    std::size_t limit = 0;  // of a container; the file holds "max" where there is none
    if (std::ifstream("/sys/fs/cgroup/memory.max") >> limit) bytes = std::min(bytes, limit);
    return bytes / 4;
}

FrameSource::FrameSource(SurfaceEmbedding W, const RecordingReader& recording, std::size_t memory)
    : W_(std::move(W)), recording_(&recording), memory_(memory) {
    std::size_t frames = 0;
    for (const TrajectoryInfo& info : recording.trajectories()) frames += info.frames;
    const auto bytes = [](Eigen::Index rows) { return static_cast<std::size_t>(rows) * 3 * sizeof(float); };
    keeps_surfaces_ = W_.rows() <= W_.cols() || frames * bytes(W_.rows()) <= memory_;
    frame_bytes_ = bytes(keeps_surfaces_ ? W_.rows() : W_.cols());
}

void FrameSource::for_each_frame(std::span<const FrameId> frames, const FrameVisitor& visitor) {
    visit(frames, false, [&](int slot, int index, VerticesRef x, VerticesRef) { visitor(slot, index, x); });
}

void FrameSource::for_each_pose(std::span<const FrameId> frames, const PoseVisitor& visitor) {
    visit(frames, true, visitor);
}

const RecordingHash& FrameSource::hashes(std::span<const FrameId> frames) {
    if (!hash_.hex.empty()) return hash_;
    auto next = frames.begin();
    hash_ = hash_recording(*recording_, [&](int trajectory, int begin, int count, const Vertices& nodes) {
        std::vector<FrameId> chosen;
        for (; next != frames.end() && *next < FrameId{trajectory, begin + count}; ++next)
            if (use(*next, false) == Use::keep) chosen.push_back(*next);
        if (chosen.empty()) return;
        check_nodes(trajectory);
        parallel_for(
            chosen.size(),
            [&](int i) {
                const FrameId& id = chosen[i];
                const Rows rows = rows_of(nodes, W_.cols(), begin, id.frame);
                if (keeps_surfaces_)
                    apply_embedding(W_, rows, kept_.at(id));
                else
                    kept_.at(id) = rows;
            },
            1);
    });
    return hash_;
}

/// Takes the room of a frame that is to be kept.
FrameSource::Use FrameSource::use(const FrameId& id, bool with_nodes) {
    if (const auto found = kept_.find(id); found != kept_.end() && found->second.size() > 0)
        return with_nodes && keeps_surfaces_ ? Use::stream : Use::kept;
    if (frame_bytes_ > memory_ - kept_bytes_) return Use::stream;
    kept_bytes_ += frame_bytes_;
    kept_[id];
    return Use::keep;
}

void FrameSource::check_nodes(int trajectory) const {
    if (recording_->nodes(trajectory) != W_.cols())
        throw std::invalid_argument(fmt::format(
            "{}: trajectory {} has {} nodes, but the embedding has {}", recording_->path().string(),
            recording_->trajectories()[trajectory].id, recording_->nodes(trajectory), W_.cols()));
}

void FrameSource::visit(std::span<const FrameId> frames, bool with_nodes, const PoseVisitor& visitor) {
    std::vector<Vertices> surfaces(frame_slots);
    Vertices nodes;
    std::array<Use, frame_slots> uses{};
    int index = 0;
    const auto total = static_cast<double>(frames.size());
    while (!frames.empty()) {
        tell_progress("poses", index, total);
        stop_if_asked();
        const int count = batch_size(frames);
        const auto batch = frames.first(count);
        int begin = 0, end = 0;  // frames to read
        for (std::size_t slot = 0; slot < batch.size(); ++slot) {
            const bool again = slot > 0 && batch[slot] == batch[slot - 1];  // its room is another slot's
            uses[slot] = again ? Use::stream : use(batch[slot], with_nodes);
            if (uses[slot] == Use::kept) continue;
            if (end == 0) begin = batch[slot].frame;
            end = batch[slot].frame + 1;
        }
        const int trajectory = batch.front().trajectory;
        if (end > 0) {
            check_nodes(trajectory);
            recording_->read(trajectory, begin, end - begin, nodes);
        }
        parallel_for(
            count,
            [&](int i) {
                const std::size_t slot = i;
                const int frame = batch[slot].frame;
                Vertices* const place = uses[slot] == Use::stream ? nullptr : &kept_.at(batch[slot]);
                if (uses[slot] == Use::kept && keeps_surfaces_)
                    return visitor(i, index + i, *place, Rows(nullptr, 0, 3));
                const Rows rows = uses[slot] == Use::kept ? Rows(place->data(), place->rows(), 3)
                                                          : rows_of(nodes, W_.cols(), begin, frame);
                const bool keep = uses[slot] == Use::keep;
                Vertices& x = keep && keeps_surfaces_ ? *place : surfaces[slot];
                apply_embedding(W_, rows, x);
                if (keep && !keeps_surfaces_) *place = rows;
                visitor(i, index + i, x, rows);
            },
            1);
        frames = frames.subspan(count);
        index += count;
    }
    tell_progress("poses", total, total);
}

}  // namespace nbd

#pragma once

#include <functional>
#include <span>

#include "training/files/recording.hpp"
#include "training/files/split.hpp"
#include "training/files/surface_body.hpp"

namespace nbd {

/// Number of slots. Concurrent calls never share a slot, and each slot gets its frames in ascending order, so
/// scratch and sums can be kept per slot; sums over the slots in order are the same on any number of threads.
inline constexpr int frame_slots = 32;

/// slot: in [0, frame_slots). index: of the frame in the list. x: surface positions [n, 3], valid during the
/// call.
using FrameVisitor = std::function<void(int slot, int index, VerticesRef x)>;

/// Visits recorded frames on the body's surface, in parallel within a batch, batch after batch. No more than
/// frame_slots surfaces and 128 frames of nodes are in memory. frames: ascending.
/// Throws what RecordingReader::read and `visit` throw.
void for_each_frame(const SurfaceBody& body, const RecordingReader& recording,
                    std::span<const FrameId> frames, const FrameVisitor& visit);

/// As above, but also passes the positions of the body's nodes, [N, 3].
using PoseVisitor = std::function<void(int slot, int index, VerticesRef x, VerticesRef nodes)>;
void for_each_pose(const SurfaceBody& body, const RecordingReader& recording, std::span<const FrameId> frames,
                   const PoseVisitor& visit);

/// Throws std::runtime_error unless every trajectory was recorded from this very body.
void check_recording(const SurfaceBody& body, const RecordingReader& recording);

}  // namespace nbd

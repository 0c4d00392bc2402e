#pragma once

#include <span>
#include <string_view>

#include "training/files/frame_source.hpp"
#include "training/files/surface_body.hpp"

namespace nbd {

/// Visits recorded frames once and keeps none; otherwise as FrameSource::for_each_frame().
void for_each_frame(const SurfaceBody& body, const RecordingReader& recording,
                    std::span<const FrameId> frames, const FrameVisitor& visit);

/// As above, but also passes the positions of the nodes.
void for_each_pose(const SurfaceBody& body, const RecordingReader& recording, std::span<const FrameId> frames,
                   const PoseVisitor& visit);

/// Throws std::runtime_error unless every trajectory was recorded from the body of that body_hash() and so
/// many nodes.
void check_recording(std::string_view body_hash, Eigen::Index nodes, const RecordingReader& recording);
void check_recording(const SurfaceBody& body, const RecordingReader& recording);

}  // namespace nbd

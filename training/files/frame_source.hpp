#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "collision/geometry/embedding.hpp"
#include "training/files/recording.hpp"
#include "training/files/recording_hash.hpp"
#include "training/files/split.hpp"

namespace nbd {

/// Two calls at the same time never have the same slot in [0, frame_slots), and a slot gets its frames in
/// ascending order: scratch and sums may be kept by slot, and sums over slots in order are the same on any
/// number of threads.
inline constexpr int frame_slots = 32;

/// slot: see above. index: of the frame in the list. x: surface positions [n, 3], valid during the call.
using FrameVisitor = std::function<void(int slot, int index, VerticesRef x)>;

/// Likewise, with the positions of the body's nodes, [N, 3], that carry the surface.
using PoseVisitor = std::function<void(int slot, int index, VerticesRef x, VerticesRef nodes)>;

/// A quarter of the memory that the system grants this process, bytes.
std::size_t default_frame_memory();

/// The frames of a recording on a body's surface, x = W nodes, for several passes over them. Frames are kept
/// in memory up to a limit, so that later passes neither read nor embed them again; the others are streamed.
/// Surface positions are kept if those of the whole recording fit or they are the smaller ones; otherwise
/// node positions. Passes give the same bits whatever is kept. For one thread at a time.
class FrameSource {
 public:
    /// W: [n, N] of the body, copied. recording: referred to. memory: most bytes of positions to keep; 0
    /// keeps nothing.
    FrameSource(SurfaceEmbedding W, const RecordingReader& recording,
                std::size_t memory = default_frame_memory());

    /// Visits frames in parallel within a batch, batch after batch; keeps them while there is room. Beside
    /// the kept positions, no more than frame_slots surfaces and 128 frames of nodes are in memory. frames:
    /// ascending. Throws what RecordingReader::read and `visit` throw, std::invalid_argument where the frames
    /// do not have W's nodes.
    void for_each_frame(std::span<const FrameId> frames, const FrameVisitor& visit);

    /// Likewise with the nodes, which are read again where surface positions are kept.
    void for_each_pose(std::span<const FrameId> frames, const PoseVisitor& visit);

    /// hash_recording() of the recording. The first call reads it whole and keeps `frames`, ascending, while
    /// there is room. Throws as for_each_frame().
    const RecordingHash& hashes(std::span<const FrameId> frames = {});

    const RecordingReader& recording() const noexcept { return *recording_; }
    const SurfaceEmbedding& W() const noexcept { return W_; }

    /// Bytes of positions in memory.
    std::size_t kept_bytes() const noexcept { return kept_bytes_; }

 private:
    /// What becomes of a frame in a pass.
    enum class Use { kept, keep, stream };

    Use use(const FrameId& id, bool with_nodes);
    void check_nodes(int trajectory) const;
    void visit(std::span<const FrameId> frames, bool with_nodes, const PoseVisitor& visit);

    SurfaceEmbedding W_;
    const RecordingReader* recording_;
    std::size_t memory_, kept_bytes_ = 0, frame_bytes_ = 0;
    bool keeps_surfaces_ = true;
    std::map<FrameId, Vertices> kept_;  // surface or nodes; empty: not read yet
    RecordingHash hash_;
};

}  // namespace nbd

#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// What a recording says of one trajectory beside its frames.
struct TrajectoryInfo {
    int id = 0;              // number of the trajectory in its dataset; of the body in a scene's recording
    std::uint64_t seed = 0;  // of the dataset or scene
    std::string body_hash;   // body_hash() of the body that moves
    std::string recipe;      // JSON text: the scene or excitation that made it
    std::string failure;  // empty: complete; else why it was given up. Frames then end at the last good one
    int frames = 0;       // set by the writer
};

/// Writes tet-node positions frame by frame; nothing but the current chunk is held in memory. The file
/// stands under its name only after finish(); before that, and if finish() is never called, only a
/// temporary file beside it exists, which the destructor removes.
class RecordingWriter {
 public:
    /// Throws std::runtime_error with path and reason.
    explicit RecordingWriter(const std::filesystem::path& path);
    ~RecordingWriter();
    RecordingWriter(RecordingWriter&&) noexcept;

    /// Frames of a trajectory with `nodes` nodes follow. Several trajectories may be open at once (the
    /// bodies of a scene). Returns a handle for add_frame and end_trajectory. Throws std::invalid_argument
    /// on a negative id, one that the recording has already, or no nodes.
    int begin_trajectory(const TrajectoryInfo& info, int nodes);
    /// x: [nodes, 3] float32, metres, world space. time: seconds, later than the last frame's. Throws
    /// std::invalid_argument on another shape or a number that is not finite.
    void add_frame(int handle, double time, VerticesRef x);
    /// failure: empty when complete. contacts: how many contacts pressed in each frame, where that is known.
    /// Throws std::invalid_argument where there are some, but not one number a frame.
    void end_trajectory(int handle, const std::string& failure = {},
                        std::span<const std::int32_t> contacts = {});
    /// An attribute of the whole file. Call once a name.
    void label(const std::string& name, const std::string& value);
    /// Closes open trajectories, flushes, renames.
    void finish();

 private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Reads frames on demand, from a recording or from the merged view of one that lies in several files, its
/// shards (see DatasetManifest). Not thread-safe (HDF5 is not).
class RecordingReader {
 public:
    /// Throws std::runtime_error on a missing, truncated, damaged or foreign file, be it a shard.
    explicit RecordingReader(const std::filesystem::path& path);
    ~RecordingReader();
    RecordingReader(RecordingReader&&) noexcept;

    const std::filesystem::path& path() const noexcept;
    /// In order of id. Failed trajectories included: callers that want training data leave them out.
    const std::vector<TrajectoryInfo>& trajectories() const noexcept;
    int nodes(int trajectory) const;
    /// Frames begin .. begin + count of the trajectory at that index: x is resized to [count * nodes, 3].
    /// Throws std::out_of_range on a range outside the trajectory, std::runtime_error on damaged data or
    /// non-finite positions.
    void read(int trajectory, int begin, int count, Vertices& x) const;
    /// How many frames read() has read so far, each as often as it was read.
    std::int64_t frames_read() const noexcept;
    /// How many frames all trajectories have together.
    std::int64_t frames() const noexcept;
    std::vector<double> times(int trajectory) const;
    /// How many contacts pressed in each frame; empty where the recording does not say.
    std::vector<std::int32_t> contacts(int trajectory) const;
    /// What RecordingWriter::label() wrote; "" without.
    std::string label(const std::string& name) const;

 private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace nbd

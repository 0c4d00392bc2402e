#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Facts about one trajectory, stored beside its frames.
struct TrajectoryInfo {
    int id = 0;              // number of the trajectory in a dataset, or of the body in a scene's recording
    std::uint64_t seed = 0;  // seed of the dataset or scene
    std::string body_hash;   // body_hash() of the moving body
    std::string recipe;      // JSON text: the scene or excitation that produced it
    std::string failure;     // empty if complete; otherwise why the run stopped after the last good frame
    int frames = 0;          // number of frames; set by the writer
};

/// Counts of each frame of a trajectory; a list is empty if they are unknown.
struct FrameFacts {
    std::vector<std::int32_t> contacts{};  // that press
    std::vector<std::int32_t> troubled{};  // steps of the frame that went wrong so that the pose may be off
    std::vector<std::int32_t> self_intersections{};  // pairs of faces of the body's surface that intersect

    bool operator==(const FrameFacts&) const = default;
};

/// Their names in files.
struct FrameFactName {
    const char* name;
    std::vector<std::int32_t> FrameFacts::*list;
};
inline constexpr std::array<FrameFactName, 3> frame_facts{
    {{"contacts", &FrameFacts::contacts},
     {"troubled_steps", &FrameFacts::troubled},
     {"self_intersections", &FrameFacts::self_intersections}}};

/// Writes tet-node positions frame by frame; only the current chunk is held in memory. finish() gives the
/// file its name. Until then only a temporary file exists in the same folder, and the destructor removes it.
class RecordingWriter {
 public:
    /// Throws std::runtime_error with path and reason.
    explicit RecordingWriter(const std::filesystem::path& path);
    ~RecordingWriter();
    RecordingWriter(RecordingWriter&&) noexcept;

    /// Opens a trajectory with `nodes` nodes. Several may be open at once (the bodies of a scene). Returns a
    /// handle for add_frame() and end_trajectory(). Throws std::invalid_argument on a negative or repeated
    /// id, or no nodes.
    /// with_forces: whether its frames have contact forces.
    int begin_trajectory(const TrajectoryInfo& info, int nodes, bool with_forces = false);
    /// Appends a frame. x: [nodes, 3] float32, metres, world space. time: seconds, later than the previous
    /// frame's. contact_forces: on the nodes, [nodes, 3], newtons, in a trajectory with forces; else empty.
    /// Throws std::invalid_argument on another shape, an earlier time or a non-finite number.
    void add_frame(int handle, double time, VerticesRef x, VerticesRef contact_forces = Vertices());
    /// Closes a trajectory. failure: empty if complete. Throws std::invalid_argument if a list of facts is
    /// not empty and has not one number per frame.
    void end_trajectory(int handle, const std::string& failure = {}, const FrameFacts& facts = {});
    /// Adds an attribute of the whole file. Call once per name.
    void label(const std::string& name, const std::string& value);
    /// Closes open trajectories, flushes the file and renames it.
    void finish();

 private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Reads frames on demand from a recording, or from the merged view of a recording in several shards (see
/// DatasetManifest). Not thread-safe (HDF5 is not).
class RecordingReader {
 public:
    /// Throws std::runtime_error if the file or a shard is missing, truncated, damaged or foreign.
    explicit RecordingReader(const std::filesystem::path& path);
    ~RecordingReader();
    RecordingReader(RecordingReader&&) noexcept;

    const std::filesystem::path& path() const noexcept;
    /// Sorted by id. Includes failed trajectories, which callers that want training data must skip.
    const std::vector<TrajectoryInfo>& trajectories() const noexcept;
    int nodes(int trajectory) const;
    /// Reads frames [begin, begin + count) of the trajectory at index `trajectory` into x, which is resized
    /// to [count * nodes, 3].
    /// Throws std::out_of_range on a range outside the trajectory, std::runtime_error on damaged data or
    /// non-finite positions.
    void read(int trajectory, int begin, int count, Vertices& x) const;
    /// Whether the frames of a trajectory have contact forces.
    bool has_contact_forces(int trajectory) const;
    /// Reads contact forces on the nodes, newtons, as read() reads positions. Throws std::runtime_error if
    /// the trajectory has none.
    void read_contact_forces(int trajectory, int begin, int count, Vertices& forces) const;
    /// How many frames read() has read so far, each as often as it was read.
    std::int64_t frames_read() const noexcept;
    /// How many frames all trajectories have together.
    std::int64_t frames() const noexcept;
    std::vector<double> times(int trajectory) const;
    const FrameFacts& facts(int trajectory) const;
    /// The value that RecordingWriter::label() wrote; "" if there is none.
    std::string label(const std::string& name) const;

 private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace nbd

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "collision/geometry/geometry.hpp"
#include "training/files/frame_extras.hpp"
#include "training/files/shared_text.hpp"

namespace nbd {

/// Facts about one trajectory, stored beside its frames.
struct TrajectoryInfo {
    int id = 0;              // number of the trajectory in a dataset, or of the body in a scene's recording
    std::uint64_t seed = 0;  // seed of the dataset or scene
    std::string body_hash;   // body_hash() of the moving body
    SharedText recipe;       // JSON text: the scene or excitation that produced it
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
    /// origin: what positions are counted from, metres, in double precision; not zero where float32 would be
    /// too coarse for them. Throws std::runtime_error with path and reason.
    explicit RecordingWriter(const std::filesystem::path& path,
                             const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());
    ~RecordingWriter();
    RecordingWriter(RecordingWriter&&) noexcept;

    /// Opens a trajectory with `nodes` nodes. Several may be open at once (the bodies of a scene). Returns a
    /// handle for add_frame() and end_trajectory(). Throws std::invalid_argument on a negative or repeated
    /// id, no nodes, or fields of tetrahedra without any.
    int begin_trajectory(const TrajectoryInfo& info, int nodes, const FrameContents& contents = {});
    /// Appends a frame. x: [nodes, 3] float32, metres, counted from the origin. time: seconds, later than the
    /// previous frame's. Throws std::invalid_argument on another shape, extras that the trajectory has not
    /// announced or that are missing, an earlier time, a non-finite number, or edges that are out of order.
    void add_frame(int handle, double time, VerticesRef x, const FrameExtras& extras = {});
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
    /// What the positions of all frames are counted from, metres; zero in most recordings.
    const Eigen::Vector3d& origin() const noexcept;
    /// Sorted by id. Includes failed trajectories, which callers that want training data must skip.
    const std::vector<TrajectoryInfo>& trajectories() const noexcept;
    int nodes(int trajectory) const;
    /// Reads frames [begin, begin + count) of the trajectory at index `trajectory` into x, which is resized
    /// to [count * nodes, 3], counted from origin().
    /// Throws std::out_of_range on a range outside the trajectory, std::runtime_error on damaged data or
    /// non-finite positions.
    void read(int trajectory, int begin, int count, Vertices& x) const;
    /// What the frames of a trajectory have besides positions.
    const FrameContents& contents(int trajectory) const;
    bool has(int trajectory, FrameField field) const { return contents(trajectory).fields[field]; }
    /// Reads a field as read() reads positions: [count * nodes, 3], or [count * 3 tets, 3]. Throws
    /// std::runtime_error if the trajectory does not have it.
    void read_field(int trajectory, FrameField field, int begin, int count, Vertices& rows) const;
    /// Reads the contact edges of frames [begin, begin + count), a list for each. Throws as read_field(), and
    /// std::runtime_error on edges that FrameExtras does not allow.
    std::vector<std::vector<ContactEdge>> read_contact_edges(int trajectory, int begin, int count) const;
    /// Where the contact edges of each frame begin, and their number: [frames + 1]; empty if it has none.
    const std::vector<std::int64_t>& contact_edge_offsets(int trajectory) const;
    /// Reads the arrays that frames [begin, begin + count) have besides positions.
    std::vector<FrameExtras> read_fields(int trajectory, int begin, int count) const;
    /// Likewise, and their contact edges.
    std::vector<FrameExtras> read_extras(int trajectory, int begin, int count) const;
    /// How many frames read() has read so far, each as often as it was read.
    std::int64_t frames_read() const noexcept;
    /// How many frames all trajectories have together.
    std::int64_t frames() const noexcept;
    std::vector<double> times(int trajectory) const;
    const FrameFacts& facts(int trajectory) const;
    /// Whether the recording is the merged view of a dataset, see dataset_manifest.hpp.
    bool is_dataset() const;
    /// The value that RecordingWriter::label() wrote; "" if there is none.
    std::string label(const std::string& name) const;

 private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace nbd

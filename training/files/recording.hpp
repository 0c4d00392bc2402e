#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "collision/geometry/geometry.hpp"
#include "training/files/recorded_reactions.hpp"

namespace nbd {

/// A text that does not change. Copies share its memory.
class SharedText {
 public:
    SharedText() : SharedText(std::string()) {}
    SharedText(std::string text)  // NOLINT(google-explicit-constructor): stands for the text
        : text_(std::make_shared<const std::string>(std::move(text))) {}
    SharedText(const char* text) : SharedText(std::string(text)) {}  // NOLINT(google-explicit-constructor)

    // Moving would leave a text without memory, so it copies.
    SharedText(const SharedText&) = default;
    SharedText& operator=(const SharedText&) = default;
    ~SharedText() = default;

    const std::string& str() const noexcept { return *text_; }
    operator const std::string&() const noexcept { return str(); }  // NOLINT(google-explicit-constructor)

    bool operator==(const SharedText& other) const noexcept {
        return text_ == other.text_ || *text_ == *other.text_;
    }
    friend std::ostream& operator<<(std::ostream& out, const SharedText& text) { return out << *text.text_; }

 private:
    std::shared_ptr<const std::string> text_;
};

/// Arrays that the frames of a trajectory may have besides positions.
enum class FrameField { contact_forces, first_piola_stress, deformation_gradients };

/// Their names in files. of_tets: a 3 x 3 matrix for each point of integration, one of
/// a linear tetrahedron and four of a quadratic one; else a vector for each node.
struct FrameFieldName {
    FrameField field;
    const char* name;
    bool of_tets;
};
inline constexpr std::array<FrameFieldName, 3> frame_fields{
    {{FrameField::contact_forces, "contact_forces", false},
     {FrameField::first_piola_stress, "first_piola_stress", true},
     {FrameField::deformation_gradients, "deformation_gradients", true}}};

/// A value for each field.
template <class T>
struct PerField {
    std::array<T, frame_fields.size()> values{};
    T& operator[](FrameField field) noexcept { return values[static_cast<std::size_t>(field)]; }
    const T& operator[](FrameField field) const noexcept { return values[static_cast<std::size_t>(field)]; }
    bool operator==(const PerField&) const = default;
};

/// A face that touches something in a frame.
struct ContactEdge {
    int face = 0;     // of the trajectory's surface
    int partner = 0;  // id of the trajectory that it touches, its own for itself; see the constants below
    int other = -1;   // face of the partner's surface; -1: the partner is an obstacle
    auto operator<=>(const ContactEdge&) const = default;
};
inline constexpr int unrecorded_partner = -1;  // a body without a trajectory in the file
/// Partner number of the obstacle with this index.
constexpr int obstacle_partner(int obstacle) noexcept { return -2 - obstacle; }

/// Largest distance of what touches, metres: of different bodies and obstacles, and of a body with itself.
struct ContactDistances {
    double bodies = 0, self = 0;
    bool operator==(const ContactDistances&) const = default;
};

/// What the frames of a trajectory have besides positions.
struct FrameContents {
    int tets = 0;  // number of points of integration; only for fields of these
    PerField<bool> fields{};
    std::optional<ContactDistances> contact_edges{};  // if the frames have such edges
    bool operator==(const FrameContents&) const = default;
};

/// What one frame has besides positions, as its trajectory's FrameContents say; else empty.
struct FrameExtras {
    PerField<Vertices> fields{};               // [nodes, 3], or [3 tets, 3]: three rows a tetrahedron
    std::vector<ContactEdge> contact_edges{};  // sorted, each once; pairs within the body once, face < other
};

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
    /// Adds what held and pressed the bodies in steps, in their order. The first call makes the file's table
    /// of reactions. Throws std::invalid_argument for a row that is earlier than the one before, or not
    /// finite.
    void add_reactions(std::span<const RecordedReaction> rows);
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
    /// Reads what frames [begin, begin + count) have besides positions.
    std::vector<FrameExtras> read_extras(int trajectory, int begin, int count) const;
    /// How many frames read() has read so far, each as often as it was read.
    std::int64_t frames_read() const noexcept;
    /// How many frames all trajectories have together.
    std::int64_t frames() const noexcept;
    std::vector<double> times(int trajectory) const;
    const FrameFacts& facts(int trajectory) const;
    /// Whether the recording is the merged view of a dataset, see dataset_manifest.hpp.
    bool is_dataset() const;
    /// What held and pressed the bodies in each step; none if it was not recorded. Throws std::runtime_error
    /// on damaged data, and rows of bodies without a trajectory.
    std::vector<RecordedReaction> reactions() const;
    bool has_reactions() const;
    /// The value that RecordingWriter::label() wrote; "" if there is none.
    std::string label(const std::string& name) const;

 private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Copies a trajectory. info: of the copy. same_surface: whether the copy is of the same surface; else what
/// names faces is left out.
void copy_trajectory(const RecordingReader& from, int trajectory, RecordingWriter& to,
                     const TrajectoryInfo& info, bool same_surface);

/// Throws std::runtime_error unless every trajectory was recorded from the body of that body_hash() and so
/// many nodes.
void check_recording(std::string_view body_hash, Eigen::Index nodes, const RecordingReader& recording);

}  // namespace nbd

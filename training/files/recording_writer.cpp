#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include "meshing/h5/writer.hpp"
#include "training/files/recording.hpp"
#include "training/files/recording_format.hpp"

namespace nbd {

namespace {

/// Frames per chunk of about 1 MiB, so that reading a single frame decodes little more than it needs.
std::size_t frames_per_chunk(int nodes) {
    constexpr std::size_t chunk_bytes = 1 << 20, most = 64;
    return std::clamp<std::size_t>(chunk_bytes / (static_cast<std::size_t>(nodes) * 3 * sizeof(float)), 1,
                                   most);
}

struct OpenTrajectory {
    int id, nodes;
    int positions, times;  // handles of the growing datasets
    int forces;            // likewise; -1: none
    double last_time;
    std::size_t frames = 0;
};

}  // namespace

struct RecordingWriter::Impl {
    h5::Writer file;
    std::map<int, OpenTrajectory> open;
    std::set<int> ids;
    std::set<std::string> bodies;

    explicit Impl(const std::filesystem::path& path) : file(path, recording_format) {}

    /// Appends the rows of a frame to a growing dataset.
    void append(int dataset, VerticesRef rows) {
        const auto count = static_cast<std::size_t>(rows.size());
        if (rows.outerStride() == 3) {
            file.append<float>(dataset, std::span(rows.data(), count));
        } else {
            const Vertices dense = rows;
            file.append<float>(dataset, std::span(dense.data(), count));
        }
    }

    [[noreturn]] void refuse(const std::string& what) const {
        throw std::invalid_argument(file.path().string() + ": " + what);
    }

    OpenTrajectory& at(int handle) {
        const auto found = open.find(handle);
        if (found == open.end()) refuse(fmt::format("no open trajectory has handle {}", handle));
        return found->second;
    }
};

RecordingWriter::RecordingWriter(const std::filesystem::path& path) : impl_(std::make_unique<Impl>(path)) {
    impl_->file.group("trajectories");
}

RecordingWriter::~RecordingWriter() = default;
RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;

int RecordingWriter::begin_trajectory(const TrajectoryInfo& info, int nodes, bool with_forces) {
    if (info.id < 0 || impl_->ids.contains(info.id))
        impl_->refuse(fmt::format("trajectory id {}; allowed: at least 0, each once", info.id));
    if (nodes < 1)
        impl_->refuse(fmt::format("trajectory {} has {} nodes; allowed: at least 1", info.id, nodes));
    h5::Writer& file = impl_->file;
    const std::string group = trajectory_group(info.id);
    file.group(group);
    file.attribute(group, "id", info.id);
    file.attribute(group, "seed", info.seed);
    file.attribute(group, "body_sha256", info.body_hash);
    file.write_text(group + "/recipe", info.recipe);
    const auto n = static_cast<std::size_t>(nodes);
    const int positions =
        file.begin_growing(group + "/positions", h5::Type::float32, {n, 3}, frames_per_chunk(nodes));
    const int times = file.begin_growing(group + "/times", h5::Type::float64, {}, 256);
    const int forces = with_forces ? file.begin_growing(group + '/' + contact_forces_name, h5::Type::float32,
                                                        {n, 3}, frames_per_chunk(nodes))
                                   : -1;
    impl_->ids.insert(info.id);
    impl_->bodies.insert(info.body_hash);
    impl_->open.emplace(positions, OpenTrajectory{info.id, nodes, positions, times, forces, -INFINITY});
    return positions;
}

void RecordingWriter::add_frame(int handle, double time, VerticesRef x, VerticesRef contact_forces) {
    OpenTrajectory& t = impl_->at(handle);
    if (x.rows() != t.nodes)
        impl_->refuse(
            fmt::format("a frame of trajectory {} has {} nodes; allowed: {}", t.id, x.rows(), t.nodes));
    if (!std::isfinite(time) || time <= t.last_time)
        impl_->refuse(fmt::format("a frame of trajectory {} has time {} s; allowed: finite, later than {} s",
                                  t.id, time, t.last_time));
    if (!x.allFinite())
        impl_->refuse(fmt::format(
            "a position at {} s of trajectory {} is not finite; allowed: finite numbers", time, t.id));
    if (const int wanted = t.forces < 0 ? 0 : t.nodes; contact_forces.rows() != wanted)
        impl_->refuse(fmt::format("a frame of trajectory {} has contact forces on {} nodes; allowed: {}",
                                  t.id, contact_forces.rows(), wanted));
    if (!contact_forces.allFinite())
        impl_->refuse(fmt::format(
            "a contact force at {} s of trajectory {} is not finite; allowed: finite numbers", time, t.id));
    impl_->append(t.positions, x);
    if (t.forces >= 0) impl_->append(t.forces, contact_forces);
    impl_->file.append<double>(t.times, std::span(&time, 1));
    t.last_time = time;
    ++t.frames;
}

void RecordingWriter::end_trajectory(int handle, const std::string& failure, const FrameFacts& facts) {
    const OpenTrajectory& t = impl_->at(handle);
    for (const FrameFactName& fact : frame_facts) {
        const std::vector<std::int32_t>& list = facts.*fact.list;
        if (list.empty()) continue;
        if (list.size() != t.frames)
            impl_->refuse(
                fmt::format("{} numbers of {} for the {} frames of trajectory {}; allowed: one per frame",
                            list.size(), fact.name, t.frames, t.id));
        impl_->file.write(fmt::format("{}/{}", trajectory_group(t.id), fact.name), {list.size()},
                          std::span<const std::int32_t>(list));
    }
    impl_->file.end_growing(t.positions);
    impl_->file.end_growing(t.times);
    if (t.forces >= 0) impl_->file.end_growing(t.forces);
    impl_->file.attribute(trajectory_group(t.id), "failure", failure);
    impl_->open.erase(handle);
}

void RecordingWriter::label(const std::string& name, const std::string& value) {
    impl_->file.attribute("/", name, value);
}

void RecordingWriter::finish() {
    while (!impl_->open.empty()) end_trajectory(impl_->open.begin()->first);
    impl_->file.attribute("/", "body_sha256", impl_->bodies.size() == 1 ? *impl_->bodies.begin() : "several");
    impl_->file.commit();
}

}  // namespace nbd

#include <algorithm>
#include <climits>
#include <cmath>
#include <stdexcept>

#include "meshing/h5/reader.hpp"
#include "training/files/recording.hpp"
#include "training/files/recording_format.hpp"

namespace nbd {

namespace {

struct StoredTrajectory {
    std::string group;
    TrajectoryInfo info;
    int nodes = 0;
    std::vector<double> times;
    FrameFacts facts;
    std::string shard;      // file with the positions; empty: the recording itself
    std::string positions;  // name of their dataset in that file
    std::string forces;     // name of the contact forces in the recording itself; empty: none
};

StoredTrajectory read_trajectory(const h5::Reader& file, const std::string& group) {
    StoredTrajectory t;
    t.group = group;
    const std::int64_t id = file.int_attribute(group, "id");
    if (id < 0 || id > INT_MAX)
        file.refuse(fmt::format("'{}' has id {}", group, id), fmt::format("0 to {}", INT_MAX));
    t.info.id = static_cast<int>(id);
    t.info.seed = file.uint_attribute(group, "seed");
    t.info.body_hash = file.text_attribute(group, "body_sha256");
    t.info.failure = file.text_attribute(group, "failure");
    t.info.recipe = file.read_text(group + "/recipe");
    t.positions = group + "/positions";
    const h5::Shape shape = file.check(t.positions, h5::Type::float32, {h5::any, h5::any, 3});
    if (shape[1] == 0) file.refuse(fmt::format("'{}' has no nodes", t.positions), "at least 1");
    if (const auto source = file.virtual_source(t.positions)) {
        t.shard = source->file;
        t.positions = source->dataset;
    }
    t.info.frames = static_cast<int>(shape[0]);
    t.nodes = static_cast<int>(shape[1]);
    if (const std::string forces = fmt::format("{}/{}", group, contact_forces_name); file.has(forces)) {
        file.check(forces, h5::Type::float32, {shape[0], shape[1], 3});
        t.forces = forces;
    }
    t.times = file.read<double>(group + "/times", {shape[0]});
    for (const FrameFactName& fact : frame_facts)
        if (const std::string name = fmt::format("{}/{}", group, fact.name); file.has(name))
            t.facts.*fact.list = file.read<std::int32_t>(name, {shape[0]});
    double last = -INFINITY;
    for (std::size_t i = 0; i < t.times.size(); last = t.times[i++])
        if (!std::isfinite(t.times[i]) || t.times[i] <= last)
            file.refuse(fmt::format("frame {} of '{}' has time {} s", i, group, t.times[i]),
                        fmt::format("finite, later than {} s", last));
    return t;
}

}  // namespace

struct RecordingReader::Impl {
    h5::Reader file;
    std::vector<StoredTrajectory> stored;
    std::vector<TrajectoryInfo> infos;
    std::unique_ptr<h5::Reader> shard;  // the shard read last
    std::string shard_name;
    std::int64_t frames_read = 0;

    explicit Impl(const std::filesystem::path& path) : file(path, view_format) {
        for (const std::string& name : file.children("trajectories"))
            stored.push_back(read_trajectory(file, "trajectories/" + name));
        std::ranges::sort(stored, {}, [](const StoredTrajectory& t) { return t.info.id; });
        for (const StoredTrajectory& t : stored) {
            if (!infos.empty() && infos.back().id == t.info.id)
                file.refuse(
                    fmt::format("'{}' has id {}, which another trajectory has too", t.group, t.info.id),
                    "each id once");
            infos.push_back(t.info);
            check_shard(t);
        }
    }

    const StoredTrajectory& at(int trajectory) const {
        if (trajectory < 0 || trajectory >= static_cast<int>(stored.size()))
            throw std::out_of_range(fmt::format("{}: trajectory index {}; allowed: 0 to {}",
                                                file.path().string(), trajectory,
                                                static_cast<int>(stored.size()) - 1));
        return stored[static_cast<std::size_t>(trajectory)];
    }

    /// The file with a trajectory's positions.
    const h5::Reader& source(const StoredTrajectory& t) {
        if (t.shard.empty()) return file;
        if (shard_name == t.shard) return *shard;
        shard_name.clear();
        try {
            shard = std::make_unique<h5::Reader>(file.path().parent_path() / t.shard, recording_format);
        } catch (const std::runtime_error& error) {
            throw std::runtime_error(
                fmt::format("{}: cannot read a shard: {}", file.path().string(), error.what()));
        }
        if (shard->text_attribute("/", dataset_label) != file.text_attribute("/", dataset_label))
            shard->refuse("belongs to another dataset",
                          fmt::format("the dataset of {}", file.path().string()));
        shard_name = t.shard;
        return *shard;
    }

    /// Reads frames of a dataset with three finite numbers for each node.
    void read_frames(const h5::Reader& source, const StoredTrajectory& t, const std::string& dataset,
                     int begin, int count, Vertices& rows) const {
        if (begin < 0 || count < 0 || count > t.info.frames - begin)
            throw std::out_of_range(
                fmt::format("{}: {} frames from {} of trajectory {}; allowed: within its {} frames",
                            file.path().string(), count, begin, t.info.id, t.info.frames));
        rows.resize(Eigen::Index{count} * t.nodes, 3);
        source.read_rows(dataset, static_cast<std::size_t>(begin), static_cast<std::size_t>(count),
                         rows.data());
        if (rows.allFinite()) return;
        for (Eigen::Index i = 0; i < rows.rows(); ++i)
            if (!rows.row(i).allFinite())
                source.refuse(fmt::format("node {} in frame {} of trajectory {} is not finite", i % t.nodes,
                                          begin + i / t.nodes, t.info.id),
                              dataset == t.forces ? "finite forces" : "finite positions");
    }

    void check_shard(const StoredTrajectory& t) {
        if (t.shard.empty()) return;
        source(t).check(t.positions, h5::Type::float32,
                        {static_cast<std::size_t>(t.info.frames), static_cast<std::size_t>(t.nodes), 3});
    }
};

RecordingReader::RecordingReader(const std::filesystem::path& path) : impl_(std::make_unique<Impl>(path)) {}
RecordingReader::~RecordingReader() = default;
RecordingReader::RecordingReader(RecordingReader&&) noexcept = default;

const std::filesystem::path& RecordingReader::path() const noexcept { return impl_->file.path(); }
const std::vector<TrajectoryInfo>& RecordingReader::trajectories() const noexcept { return impl_->infos; }
int RecordingReader::nodes(int trajectory) const { return impl_->at(trajectory).nodes; }
std::int64_t RecordingReader::frames_read() const noexcept { return impl_->frames_read; }
std::int64_t RecordingReader::frames() const noexcept {
    std::int64_t count = 0;
    for (const TrajectoryInfo& info : impl_->infos) count += info.frames;
    return count;
}
std::vector<double> RecordingReader::times(int trajectory) const { return impl_->at(trajectory).times; }
const FrameFacts& RecordingReader::facts(int trajectory) const { return impl_->at(trajectory).facts; }

std::string RecordingReader::label(const std::string& name) const {
    return impl_->file.has_attribute("/", name) ? impl_->file.text_attribute("/", name) : "";
}

void RecordingReader::read(int trajectory, int begin, int count, Vertices& x) const {
    const StoredTrajectory& t = impl_->at(trajectory);
    impl_->read_frames(impl_->source(t), t, t.positions, begin, count, x);
    impl_->frames_read += count;
}

bool RecordingReader::has_contact_forces(int trajectory) const {
    return !impl_->at(trajectory).forces.empty();
}

void RecordingReader::read_contact_forces(int trajectory, int begin, int count, Vertices& forces) const {
    const StoredTrajectory& t = impl_->at(trajectory);
    if (t.forces.empty())
        throw std::runtime_error(
            fmt::format("{}: trajectory {} has no contact forces", path().string(), t.info.id));
    impl_->read_frames(impl_->file, t, t.forces, begin, count, forces);
}

}  // namespace nbd

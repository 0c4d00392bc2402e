#include <algorithm>
#include <climits>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "meshing/h5/reader.hpp"
#include "training/files/reaction_arrays.hpp"
#include "training/files/recording.hpp"
#include "training/files/recording_format.hpp"

namespace nbd {

namespace {

/// Where an array of a trajectory is stored.
struct StoredArray {
    std::string shard;    // file; empty: the recording itself
    std::string dataset;  // in that file
    h5::Type type = h5::Type::float32;
    h5::Shape shape;
};

struct StoredTrajectory {
    std::string group;
    TrajectoryInfo info;
    int nodes = 0;
    std::vector<double> times;
    FrameFacts facts;
    StoredArray positions;
    FrameContents contents;
    PerField<StoredArray> fields;  // those that it has
    StoredArray edges;             // if it has contact edges
    std::vector<std::int64_t> edge_offsets;
};

StoredArray find_array(const h5::Reader& file, const std::string& name, h5::Type type,
                       const h5::Shape& expected) {
    StoredArray array{.shard = {}, .dataset = name, .type = type, .shape = file.check(name, type, expected)};
    if (const auto source = file.virtual_source(name)) {
        array.shard = source->file;
        array.dataset = source->dataset;
    }
    return array;
}

double distance_attribute(const h5::Reader& file, const std::string& dataset, const char* name) {
    const double distance = file.attribute<double>(dataset, name);
    if (!(distance >= 0 && std::isfinite(distance)))
        file.refuse(fmt::format("'{}' has {} {} m", dataset, name, distance), "finite, at least 0");
    return distance;
}

void find_contact_edges(const h5::Reader& file, StoredTrajectory& t) {
    const std::string edges = fmt::format("{}/{}", t.group, contact_edges_name),
                      offsets = fmt::format("{}/{}", t.group, contact_edge_offsets_name);
    if (!file.has(edges)) return;
    t.edges = find_array(file, edges, h5::Type::int32, {h5::any, 3});
    t.contents.contact_edges = {.bodies = distance_attribute(file, edges, contact_distance_name),
                                .self = distance_attribute(file, edges, self_contact_distance_name)};
    t.edge_offsets = file.read<std::int64_t>(offsets, {static_cast<std::size_t>(t.info.frames) + 1});
    const std::int64_t count = t.edges.shape[0];
    if (t.edge_offsets.front() != 0 || t.edge_offsets.back() != count ||
        !std::ranges::is_sorted(t.edge_offsets))
        file.refuse(fmt::format("'{}' does not ascend from 0 to {}", offsets, count),
                    "the ascending places at which frames begin, and the number of edges");
}

void find_fields(const h5::Reader& file, StoredTrajectory& t) {
    const std::size_t frames = t.info.frames, nodes = t.nodes;
    for (const FrameFieldName& field : frame_fields) {
        const std::string name = fmt::format("{}/{}", t.group, field.name);
        if (!file.has(name)) continue;
        const std::size_t tets = t.contents.tets > 0 ? static_cast<std::size_t>(t.contents.tets) : h5::any;
        t.fields[field.field] =
            find_array(file, name, h5::Type::float32,
                       field.of_tets ? h5::Shape{frames, tets, 3, 3} : h5::Shape{frames, nodes, 3});
        t.contents.fields[field.field] = true;
        if (field.of_tets) t.contents.tets = t.fields[field.field].shape[1];
    }
}

/// Texts that were read, by the names of their datasets.
using Recipes = std::map<std::string, SharedText>;

/// Equal recipes are soft links to one dataset, which is read once.
SharedText read_recipe(const h5::Reader& file, const std::string& name, Recipes& known) {
    const std::string target = file.link_target(name);
    const std::string stored = target.starts_with('/') ? target : "/" + name;
    if (const auto found = known.find(stored); found != known.end()) return found->second;
    return known[stored] = file.read_text(name);
}

StoredTrajectory read_trajectory(const h5::Reader& file, const std::string& group, Recipes& recipes) {
    StoredTrajectory t;
    t.group = group;
    t.info.id = file.attribute<int>(group, "id");
    if (t.info.id < 0)
        file.refuse(fmt::format("'{}' has id {}", group, t.info.id), fmt::format("0 to {}", INT_MAX));
    t.info.seed = file.attribute<std::uint64_t>(group, "seed");
    t.info.body_hash = file.attribute<std::string>(group, "body_sha256");
    t.info.failure = file.attribute<std::string>(group, "failure");
    t.info.recipe = read_recipe(file, group + "/recipe", recipes);
    t.positions = find_array(file, group + "/positions", h5::Type::float32, {h5::any, h5::any, 3});
    const h5::Shape& shape = t.positions.shape;
    if (shape[1] == 0) file.refuse(fmt::format("'{}/positions' has no nodes", group), "at least 1");
    t.info.frames = shape[0];
    t.nodes = shape[1];
    find_fields(file, t);
    find_contact_edges(file, t);
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
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();

    explicit Impl(const std::filesystem::path& path) : file(path, view_format) {
        if (file.has(origin_name)) origin = file.matrix<Eigen::VectorXd>(origin_name, 3);
        if (!origin.allFinite()) file.refuse("its origin is not finite", "finite numbers");
        Recipes recipes;
        for (const std::string& name : file.children("trajectories"))
            stored.push_back(read_trajectory(file, "trajectories/" + name, recipes));
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
        if (trajectory < 0 || trajectory >= std::ssize(stored))
            throw std::out_of_range(fmt::format("{}: trajectory index {}; allowed: 0 to {}",
                                                file.path().string(), trajectory,
                                                static_cast<int>(stored.size()) - 1));
        return stored[trajectory];
    }

    /// The file with an array's numbers.
    const h5::Reader& source(const StoredArray& array) {
        if (array.shard.empty()) return file;
        if (shard_name == array.shard) return *shard;
        shard_name.clear();
        try {
            shard = std::make_unique<h5::Reader>(file.path().parent_path() / array.shard, recording_format);
        } catch (const std::runtime_error& error) {
            throw std::runtime_error(
                fmt::format("{}: cannot read a shard: {}", file.path().string(), error.what()));
        }
        if (shard->attribute<std::string>("/", dataset_label) !=
            file.attribute<std::string>("/", dataset_label))
            shard->refuse("belongs to another dataset",
                          fmt::format("the dataset of {}", file.path().string()));
        shard_name = array.shard;
        return *shard;
    }

    void check_frames(const StoredTrajectory& t, int begin, int count) const {
        if (begin < 0 || count < 0 || count > t.info.frames - begin)
            throw std::out_of_range(
                fmt::format("{}: {} frames from {} of trajectory {}; allowed: within its {} frames",
                            file.path().string(), count, begin, t.info.id, t.info.frames));
    }

    /// Reads frames of an array of finite numbers. what: an item of a frame, for example "node". allowed: for
    /// errors.
    void read_frames(const StoredTrajectory& t, const StoredArray& array, std::string_view what,
                     const char* allowed, int begin, int count, Vertices& rows) {
        check_frames(t, begin, count);
        const Eigen::Index per_frame =
            static_cast<Eigen::Index>(h5::element_count(array.shape)) / std::max(t.info.frames, 1) / 3;
        const h5::Reader& from = source(array);
        rows.resize(count * per_frame, 3);
        from.read_rows(array.dataset, begin, count, rows.data());
        if (rows.allFinite()) return;
        const Eigen::Index per_item = per_frame / static_cast<Eigen::Index>(array.shape[1]);
        for (Eigen::Index i = 0; i < rows.rows(); ++i)
            if (!rows.row(i).allFinite())
                from.refuse(fmt::format("{} {} in frame {} of trajectory {} is not finite", what,
                                        i % per_frame / per_item, begin + i / per_frame, t.info.id),
                            allowed);
    }

    /// Throws unless the files with a trajectory's arrays have them.
    void check_shard(const StoredTrajectory& t) {
        const auto check = [&](const StoredArray& array) {
            if (!array.shard.empty()) source(array).check(array.dataset, array.type, array.shape);
        };
        check(t.positions);
        for (const FrameFieldName& field : frame_fields)
            if (t.contents.fields[field.field]) check(t.fields[field.field]);
        if (t.contents.contact_edges) check(t.edges);
    }
};

RecordingReader::RecordingReader(const std::filesystem::path& path) : impl_(std::make_unique<Impl>(path)) {}
RecordingReader::~RecordingReader() = default;
RecordingReader::RecordingReader(RecordingReader&&) noexcept = default;

const std::filesystem::path& RecordingReader::path() const noexcept { return impl_->file.path(); }
const Eigen::Vector3d& RecordingReader::origin() const noexcept { return impl_->origin; }
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

bool RecordingReader::is_dataset() const { return impl_->file.has(dataset_plan); }

bool RecordingReader::has_reactions() const { return impl_->file.has(reactions_group); }

std::vector<RecordedReaction> RecordingReader::reactions() const {
    std::vector<RecordedReaction> rows = read_reactions(impl_->file);
    for (const RecordedReaction& row : rows)
        if (!std::ranges::binary_search(impl_->infos, row.body, {}, &TrajectoryInfo::id))
            impl_->file.refuse(fmt::format("a reaction acts on body {}", row.body), "the id of a trajectory");
    return rows;
}

std::string RecordingReader::label(const std::string& name) const {
    return impl_->file.has_attribute("/", name) ? impl_->file.attribute<std::string>("/", name) : "";
}

void RecordingReader::read(int trajectory, int begin, int count, Vertices& x) const {
    const StoredTrajectory& t = impl_->at(trajectory);
    impl_->read_frames(t, t.positions, "node", "finite positions", begin, count, x);
    impl_->frames_read += count;
}

const FrameContents& RecordingReader::contents(int trajectory) const {
    return impl_->at(trajectory).contents;
}

void RecordingReader::read_field(int trajectory, FrameField field, int begin, int count,
                                 Vertices& rows) const {
    const StoredTrajectory& t = impl_->at(trajectory);
    const FrameFieldName& name = frame_fields[static_cast<std::size_t>(field)];
    if (!t.contents.fields[field])
        throw std::runtime_error(
            fmt::format("{}: trajectory {} has no {}", path().string(), t.info.id, name.name));
    impl_->read_frames(t, t.fields[field],
                       fmt::format("{} of {}", name.name, name.of_tets ? "tetrahedron" : "node"),
                       "finite numbers", begin, count, rows);
}

std::vector<std::vector<ContactEdge>> RecordingReader::read_contact_edges(int trajectory, int begin,
                                                                          int count) const {
    const StoredTrajectory& t = impl_->at(trajectory);
    if (!t.contents.contact_edges)
        throw std::runtime_error(
            fmt::format("{}: trajectory {} has no contact edges", path().string(), t.info.id));
    impl_->check_frames(t, begin, count);
    const auto offset = [&](int frame) { return t.edge_offsets[frame]; };
    const std::size_t first = offset(begin);
    const auto all = static_cast<std::size_t>(offset(begin + count)) - first;
    std::vector<std::int32_t> rows(3 * all);
    const h5::Reader& from = impl_->source(t.edges);
    from.read_rows(t.edges.dataset, first, all, rows.data());
    std::vector<std::vector<ContactEdge>> result(count);
    for (int i = 0; i < count; ++i) {
        auto& edges = result[i];
        for (auto e = static_cast<std::size_t>(offset(begin + i)) - first;
             e < static_cast<std::size_t>(offset(begin + i + 1)) - first; ++e)
            edges.push_back({rows[3 * e], rows[3 * e + 1], rows[3 * e + 2]});
        if (const std::string defect = edge_defect(edges, t.info.id); !defect.empty())
            throw std::runtime_error(fmt::format("{}: frame {} of trajectory {} has the {}",
                                                 from.path().string(), begin + i, t.info.id, defect));
    }
    return result;
}

const std::vector<std::int64_t>& RecordingReader::contact_edge_offsets(int trajectory) const {
    return impl_->at(trajectory).edge_offsets;
}

std::vector<FrameExtras> RecordingReader::read_extras(int trajectory, int begin, int count) const {
    const FrameContents& contents = this->contents(trajectory);
    std::vector<FrameExtras> extras(count);
    Vertices rows;
    for (const FrameFieldName& field : frame_fields) {
        if (!contents.fields[field.field]) continue;
        read_field(trajectory, field.field, begin, count, rows);
        const Eigen::Index per_frame = rows.rows() / std::max(count, 1);
        for (int i = 0; i < count; ++i)
            extras[static_cast<std::size_t>(i)].fields[field.field] =
                rows.middleRows(i * per_frame, per_frame);
    }
    if (!contents.contact_edges) return extras;
    auto edges = read_contact_edges(trajectory, begin, count);
    for (std::size_t i = 0; i < extras.size(); ++i) extras[i].contact_edges = std::move(edges[i]);
    return extras;
}

void check_recording(std::string_view body_hash, Eigen::Index nodes, const RecordingReader& recording) {
    const auto& infos = recording.trajectories();
    for (std::size_t i = 0; i < infos.size(); ++i) {
        if (infos[i].body_hash != body_hash)
            throw std::runtime_error(
                fmt::format("{}: trajectory {} is of body {:.12}, but this body is {:.12}",
                            recording.path().string(), infos[i].id, infos[i].body_hash, body_hash));
        const int recorded = recording.nodes(i);
        if (recorded != nodes)
            throw std::runtime_error(fmt::format("{}: trajectory {} has {} nodes, but the body has {}",
                                                 recording.path().string(), infos[i].id, recorded, nodes));
    }
}

}  // namespace nbd

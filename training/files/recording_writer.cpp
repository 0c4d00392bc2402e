#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>

#include "collision/base/stop.hpp"
#include "meshing/h5/writer.hpp"
#include "training/files/reaction_arrays.hpp"
#include "training/files/recording.hpp"
#include "training/files/recording_format.hpp"

namespace nbd {

std::string edge_defect(std::span<const ContactEdge> edges, int id) {
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const ContactEdge& edge = edges[i];
        const auto& [face, partner, other] = edge;
        const auto defect = [&](const char* allowed) {
            return fmt::format("contact edge ({}, {}, {}); allowed: {}", edge.face, edge.partner, edge.other,
                               allowed);
        };
        if (face < 0) return defect("faces from 0 on");
        if (partner < unrecorded_partner && other != -1) return defect("face -1 of an obstacle");
        if (partner >= unrecorded_partner && other < 0) return defect("faces from 0 on");
        if (partner == id && other <= face) return defect("the lower face of the body itself first");
        if (i > 0 && !(edges[i - 1] < edges[i])) return defect("ascending edges, each once");
    }
    return {};
}

namespace {

/// Frames per chunk of about 1 MiB, so that reading a single frame decodes little more than it needs.
std::size_t frames_per_chunk(std::size_t numbers_of_a_frame) {
    constexpr std::size_t chunk_bytes = 1 << 20, most = 64;
    return std::clamp<std::size_t>(chunk_bytes / (numbers_of_a_frame * sizeof(float)), 1, most);
}

struct OpenTrajectory {
    int id = 0, nodes = 0;
    FrameContents contents{};
    int positions = -1, times = -1;  // handles of the growing datasets
    PerField<int> fields{};          // likewise, of those that it has
    int edges = -1, offsets = -1;    // likewise, if it has contact edges
    double last_time = -INFINITY;
    std::size_t frames = 0;
    std::int64_t edge_count = 0;
};

}  // namespace

struct RecordingWriter::Impl {
    h5::Writer file;
    std::map<int, OpenTrajectory> open;
    std::set<int> ids;
    std::set<std::string> bodies;
    std::string last_recipe, last_recipe_name;  // of the recipe that was written last
    std::optional<ReactionArrays> reactions{};

    explicit Impl(const std::filesystem::path& path) : file(path, recording_format) {}

    /// Appends the rows of a frame to a growing dataset.
    void append(int dataset, VerticesRef rows) {
        const std::size_t count = rows.size();
        if (rows.outerStride() == 3) {
            file.append<float>(dataset, std::span(rows.data(), count));
        } else {
            const Vertices dense = rows;
            file.append<float>(dataset, std::span(dense.data(), count));
        }
    }

    /// The bodies of a scene have one recipe: those after the first link to it.
    void write_recipe(const std::string& name, const std::string& recipe) {
        if (!last_recipe_name.empty() && recipe == last_recipe) {
            file.link(name, "/" + last_recipe_name);
            return;
        }
        file.write_text(name, recipe);
        last_recipe = recipe;
        last_recipe_name = name;
    }

    void append_edges(OpenTrajectory& t, const std::vector<ContactEdge>& edges) {
        std::vector<std::int32_t> rows;
        for (const auto& [face, partner, other] : edges) rows.insert(rows.end(), {face, partner, other});
        if (!rows.empty()) file.append<std::int32_t>(t.edges, rows);
        t.edge_count += edges.size();
        file.append<std::int64_t>(t.offsets, std::span(&t.edge_count, 1));
    }

    void check_extras(const OpenTrajectory& t, double time, const FrameExtras& extras) const {
        for (const FrameFieldName& field : frame_fields) {
            const Vertices& rows = extras.fields[field.field];
            const int whole = field.of_tets ? 3 * t.contents.tets : t.nodes;
            if (const int wanted = t.contents.fields[field.field] ? whole : 0; rows.rows() != wanted)
                refuse(fmt::format("a frame of trajectory {} has {} rows of {}; allowed: {}", t.id,
                                   rows.rows(), field.name, wanted));
            if (!rows.allFinite())
                refuse(
                    fmt::format("a number of {} at {} s of trajectory {} is not finite; allowed: finite "
                                "numbers",
                                field.name, time, t.id));
        }
        if (!t.contents.contact_edges && !extras.contact_edges.empty())
            refuse(fmt::format("a frame of trajectory {} has contact edges; allowed: none", t.id));
        if (const std::string defect = edge_defect(extras.contact_edges, t.id); !defect.empty())
            refuse(fmt::format("a frame of trajectory {} has the {}", t.id, defect));
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

RecordingWriter::RecordingWriter(const std::filesystem::path& path, const Eigen::Vector3d& origin)
    : impl_(std::make_unique<Impl>(path)) {
    if (!origin.allFinite()) impl_->refuse("its origin is not finite; allowed: finite numbers");
    if (!origin.isZero(0)) impl_->file.write(origin_name, origin);
    impl_->file.group("trajectories");
}

RecordingWriter::~RecordingWriter() = default;
RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;

int RecordingWriter::begin_trajectory(const TrajectoryInfo& info, int nodes, const FrameContents& contents) {
    if (info.id < 0 || impl_->ids.contains(info.id))
        impl_->refuse(fmt::format("trajectory id {}; allowed: at least 0, each once", info.id));
    if (nodes < 1)
        impl_->refuse(fmt::format("trajectory {} has {} nodes; allowed: at least 1", info.id, nodes));
    for (const FrameFieldName& field : frame_fields)
        if (contents.fields[field.field] && field.of_tets && contents.tets < 1)
            impl_->refuse(fmt::format("trajectory {} has {} of {} tetrahedra; allowed: at least 1", info.id,
                                      field.name, contents.tets));
    if (contents.contact_edges)
        for (const double distance : {contents.contact_edges->bodies, contents.contact_edges->self})
            if (!(distance >= 0 && std::isfinite(distance)))
                impl_->refuse(
                    fmt::format("trajectory {} has contact edges within {} m; allowed: finite, at least 0",
                                info.id, distance));
    h5::Writer& file = impl_->file;
    const std::string group = trajectory_group(info.id);
    file.group(group);
    file.attribute(group, "id", info.id);
    file.attribute(group, "seed", info.seed);
    file.attribute(group, "body_sha256", info.body_hash);
    impl_->write_recipe(group + "/recipe", info.recipe);
    const std::size_t n = nodes, tets = contents.tets;
    OpenTrajectory t{.id = info.id, .nodes = nodes, .contents = contents};
    t.positions =
        file.begin_growing(group + "/positions", h5::Type::float32, {n, 3}, frames_per_chunk(3 * n));
    t.times = file.begin_growing(group + "/times", h5::Type::float64, {}, 256);
    for (const FrameFieldName& field : frame_fields) {
        if (!contents.fields[field.field]) continue;
        const h5::Shape row = field.of_tets ? h5::Shape{tets, 3, 3} : h5::Shape{n, 3};
        t.fields[field.field] = file.begin_growing(fmt::format("{}/{}", group, field.name), h5::Type::float32,
                                                   row, frames_per_chunk(h5::element_count(row)));
    }
    if (contents.contact_edges) {
        const std::string edges = fmt::format("{}/{}", group, contact_edges_name);
        t.edges = file.begin_growing(edges, h5::Type::int32, {3}, 4096);
        file.attribute(edges, contact_distance_name, contents.contact_edges->bodies);
        file.attribute(edges, self_contact_distance_name, contents.contact_edges->self);
        t.offsets = file.begin_growing(fmt::format("{}/{}", group, contact_edge_offsets_name),
                                       h5::Type::int64, {}, 256);
        file.append<std::int64_t>(t.offsets, std::span(&t.edge_count, 1));
    }
    impl_->ids.insert(info.id);
    impl_->bodies.insert(info.body_hash);
    impl_->open.emplace(t.positions, t);
    return t.positions;
}

void RecordingWriter::add_frame(int handle, double time, VerticesRef x, const FrameExtras& extras) {
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
    impl_->check_extras(t, time, extras);
    impl_->append(t.positions, x);
    for (const FrameFieldName& field : frame_fields)
        if (t.contents.fields[field.field]) impl_->append(t.fields[field.field], extras.fields[field.field]);
    if (t.contents.contact_edges) impl_->append_edges(t, extras.contact_edges);
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
    for (const FrameFieldName& field : frame_fields)
        if (t.contents.fields[field.field]) impl_->file.end_growing(t.fields[field.field]);
    if (t.contents.contact_edges)
        for (const int dataset : {t.edges, t.offsets}) impl_->file.end_growing(dataset);
    impl_->file.attribute(trajectory_group(t.id), "failure", failure);
    impl_->open.erase(handle);
}

void RecordingWriter::add_reactions(std::span<const RecordedReaction> rows) {
    if (!impl_->reactions) impl_->reactions.emplace(impl_->file);
    impl_->reactions->add(rows);
}

void RecordingWriter::label(const std::string& name, const std::string& value) {
    impl_->file.attribute("/", name, value);
}

void RecordingWriter::finish() {
    while (!impl_->open.empty()) end_trajectory(impl_->open.begin()->first);
    if (impl_->reactions) impl_->reactions->finish();
    impl_->file.attribute("/", "body_sha256", impl_->bodies.size() == 1 ? *impl_->bodies.begin() : "several");
    impl_->file.commit();
}

void copy_trajectory(const RecordingReader& from, int trajectory, RecordingWriter& to,
                     const TrajectoryInfo& info, bool same_surface) {
    constexpr int frames_at_once = 16;
    FrameContents contents = from.contents(trajectory);
    FrameFacts facts = from.facts(trajectory);
    if (!same_surface) {
        contents.contact_edges.reset();
        facts.self_intersections.clear();
    }
    const std::vector<double> times = from.times(trajectory);
    const int nodes = from.nodes(trajectory), handle = to.begin_trajectory(info, nodes, contents);
    Vertices x;
    for (int begin = 0; begin < info.frames; begin += frames_at_once) {
        stop_if_asked();
        const int count = std::min(frames_at_once, info.frames - begin);
        from.read(trajectory, begin, count, x);
        std::vector<FrameExtras> extras = from.read_extras(trajectory, begin, count);
        for (int i = 0; i < count; ++i) {
            if (!same_surface) extras[i].contact_edges.clear();
            to.add_frame(handle, times[begin + i], x.middleRows(Eigen::Index{i} * nodes, nodes), extras[i]);
        }
    }
    to.end_trajectory(handle, info.failure, facts);
}

}  // namespace nbd

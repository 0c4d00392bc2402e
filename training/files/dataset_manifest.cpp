#include "training/files/dataset_manifest.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "meshing/h5/reader.hpp"
#include "meshing/h5/writer.hpp"
#include "training/files/recording_format.hpp"

namespace nbd {

namespace {

constexpr std::size_t hash_length = 64;
constexpr const char* splits_group = "dataset/splits/";

/// One line per shard, in the format of sha256sum.
std::string checksum_list(const std::vector<DatasetShard>& shards) {
    std::string text;
    for (const DatasetShard& shard : shards)
        fmt::format_to(std::back_inserter(text), "{}  {}\n", shard.sha256, shard.file);
    return text;
}

std::vector<DatasetShard> parse_checksum_list(const h5::Reader& file, const std::string& text) {
    std::vector<DatasetShard> shards;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        if (line.size() <= hash_length + 2)
            file.refuse(fmt::format("'dataset/shards' has the line '{}'", line), "a SHA-256 and a file name");
        const std::string shard = line.substr(hash_length + 2);
        if (!h5::stays_in_folder(shard))
            file.refuse(fmt::format("'dataset/shards' names '{}', outside of the folder of the file", shard),
                        "files in that folder or below");
        shards.push_back({shard, line.substr(0, hash_length)});
    }
    return shards;
}

/// Writes what a trajectory has for each frame as virtual datasets that refer to a shard.
void refer_to_arrays(h5::Writer& view, const std::string& group, const RecordingReader& source, int i,
                     const std::string& shard) {
    const std::size_t frames = source.trajectories()[i].frames, nodes = source.nodes(i);
    const FrameContents& contents = source.contents(i);
    const std::size_t tets = contents.tets;
    const auto refer = [&](const std::string& name, h5::Type type, const h5::Shape& shape) {
        const std::string dataset = fmt::format("{}/{}", group, name);
        view.write_virtual(dataset, type, shape, {shard, "/" + dataset});
    };
    refer("positions", h5::Type::float32, {frames, nodes, 3});
    for (const FrameFieldName& field : frame_fields)
        if (contents.fields[field.field])
            refer(field.name, h5::Type::float32,
                  field.of_tets ? h5::Shape{frames, tets, 3, 3} : h5::Shape{frames, nodes, 3});
    if (!contents.contact_edges) return;
    const std::vector<std::int64_t>& offsets = source.contact_edge_offsets(i);
    const std::string edges = fmt::format("{}/{}", group, contact_edges_name);
    refer(contact_edges_name, h5::Type::int32, {static_cast<std::size_t>(offsets.back()), 3});
    view.attribute(edges, contact_distance_name, contents.contact_edges->bodies);
    view.attribute(edges, self_contact_distance_name, contents.contact_edges->self);
    view.write(fmt::format("{}/{}", group, contact_edge_offsets_name), offsets);
}

/// origin: that of the shards before; set by the first.
void copy_trajectories(h5::Writer& view, const std::string& key, const std::filesystem::path& folder,
                       const DatasetShard& shard, std::optional<Eigen::Vector3d>& origin) {
    const RecordingReader source(folder / shard.file);
    if (source.label(dataset_label) != key)
        throw std::runtime_error(fmt::format("{}: belongs to another dataset", source.path().string()));
    if (origin.value_or(source.origin()) != source.origin())
        throw std::runtime_error(fmt::format(
            "{}: counts positions from another origin than the shards before", source.path().string()));
    origin = source.origin();
    for (int i = 0; const TrajectoryInfo& info : source.trajectories()) {
        const std::string group = trajectory_group(info.id);
        view.group(group);
        view.attribute(group, "id", info.id);
        view.attribute(group, "seed", info.seed);
        view.attribute(group, "body_sha256", info.body_hash);
        view.attribute(group, "failure", info.failure);
        view.write_text(group + "/recipe", info.recipe.str());
        view.write(group + "/times", source.times(i));
        for (const FrameFactName& fact : frame_facts)
            if (const auto& list = source.facts(i).*fact.list; !list.empty())
                view.write(fmt::format("{}/{}", group, fact.name), list);
        refer_to_arrays(view, group, source, i, shard.file);
        ++i;
    }
}

/// False for what is no regular file, or begins in another way. True where it cannot be read: the reader says
/// why.
bool begins_as_hdf5(const std::filesystem::path& path) {
    if (!std::filesystem::is_regular_file(path)) return false;
    std::ifstream file(path, std::ios::binary);
    std::array<char, 8> bytes{};
    if (!file || (!file.read(bytes.data(), bytes.size()) && file.bad())) return true;
    return std::string_view(bytes.data(), bytes.size()) == "\x89HDF\r\n\x1a\n";
}

std::vector<DatasetSplit> read_splits(const h5::Reader& file) {
    std::vector<DatasetSplit> splits;
    if (!file.has("dataset/splits")) return splits;
    for (const std::string& name : file.children("dataset/splits")) {
        const std::string group = splits_group + name;
        splits.push_back({.name = name,
                          .train = file.read<int>(group + "/train", {h5::any}),
                          .held_out = file.read<int>(group + "/held_out", {h5::any}),
                          .rule = file.read_text(group + "/rule")});
    }
    return splits;
}

}  // namespace

void write_dataset_view(const std::filesystem::path& path, const DatasetManifest& manifest) {
    h5::Writer view(path, view_format);
    view.attribute("/", dataset_label, manifest.key);
    view.group("trajectories");
    std::optional<Eigen::Vector3d> origin;
    for (const DatasetShard& shard : manifest.shards)
        copy_trajectories(view, manifest.key, path.parent_path(), shard, origin);
    if (origin && !origin->isZero(0)) view.write(origin_name, *origin);
    view.write_text(dataset_plan, manifest.plan);
    view.write_text("dataset/shards", checksum_list(manifest.shards));
    view.write_text("dataset/variety", manifest.variety);
    view.write("dataset/split/train", manifest.train_trajectories);
    view.write("dataset/split/held_out", manifest.held_out_trajectories);
    for (const DatasetSplit& split : manifest.splits) {
        const std::string group = splits_group + split.name;
        view.write(group + "/train", split.train);
        view.write(group + "/held_out", split.held_out);
        view.write_text(group + "/rule", split.rule);
    }
    view.commit();
}

DatasetSplit DatasetManifest::split(std::string_view name) const {
    if (name == trajectory_split)
        return {.name = trajectory_split, .train = train_trajectories, .held_out = held_out_trajectories};
    std::string known = trajectory_split;
    for (const DatasetSplit& split : splits) {
        if (split.name == name) return split;
        known += ", " + split.name;
    }
    throw std::invalid_argument(fmt::format("the dataset has no split \"{}\"; allowed: {}", name, known));
}

bool is_dataset_view(const std::filesystem::path& path) {
    if (!begins_as_hdf5(path)) return false;
    const h5::Reader file(path);
    return file.format().name == view_format.name && file.has(dataset_plan);
}

DatasetManifest read_dataset_manifest(const std::filesystem::path& path) {
    const h5::Reader file(path, view_format);
    return {.key = file.attribute<std::string>("/", dataset_label),
            .plan = file.read_text(dataset_plan),
            .shards = parse_checksum_list(file, file.read_text("dataset/shards")),
            .train_trajectories = file.read<int>("dataset/split/train", {h5::any}),
            .held_out_trajectories = file.read<int>("dataset/split/held_out", {h5::any}),
            .variety = file.read_text("dataset/variety"),
            .splits = read_splits(file)};
}

}  // namespace nbd

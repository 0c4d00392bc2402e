#include "training/files/dataset_manifest.hpp"

#include <fmt/format.h>

#include <iterator>
#include <sstream>
#include <stdexcept>

#include "meshing/h5/reader.hpp"
#include "meshing/h5/writer.hpp"
#include "training/files/recording_format.hpp"

namespace nbd {

namespace {

constexpr std::size_t hash_length = 64;

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
        shards.push_back({line.substr(hash_length + 2), line.substr(0, hash_length)});
    }
    return shards;
}

void copy_trajectories(h5::Writer& view, const std::string& key, const std::filesystem::path& folder,
                       const DatasetShard& shard) {
    const RecordingReader source(folder / shard.file);
    if (source.label(dataset_label) != key)
        throw std::runtime_error(fmt::format("{}: belongs to another dataset", source.path().string()));
    for (int i = 0; const TrajectoryInfo& info : source.trajectories()) {
        const std::string group = trajectory_group(info.id);
        view.group(group);
        view.attribute(group, "id", info.id);
        view.attribute(group, "seed", info.seed);
        view.attribute(group, "body_sha256", info.body_hash);
        view.attribute(group, "failure", info.failure);
        view.write_text(group + "/recipe", info.recipe);
        view.write(group + "/times", source.times(i));
        for (const FrameFactName& fact : frame_facts)
            if (const auto& list = source.facts(i).*fact.list; !list.empty())
                view.write(fmt::format("{}/{}", group, fact.name), list);
        const auto frames = static_cast<std::size_t>(info.frames),
                   nodes = static_cast<std::size_t>(source.nodes(i));
        view.write_virtual(group + "/positions", h5::Type::float32, {frames, nodes, 3},
                           {shard.file, "/" + group + "/positions"});
        ++i;
    }
}

}  // namespace

void write_dataset_view(const std::filesystem::path& path, const DatasetManifest& manifest) {
    h5::Writer view(path, view_format);
    view.attribute("/", dataset_label, manifest.key);
    view.group("trajectories");
    for (const DatasetShard& shard : manifest.shards)
        copy_trajectories(view, manifest.key, path.parent_path(), shard);
    view.write_text("dataset/plan", manifest.plan);
    view.write_text("dataset/shards", checksum_list(manifest.shards));
    view.write_text("dataset/variety", manifest.variety);
    view.write("dataset/split/train", manifest.train_trajectories);
    view.write("dataset/split/held_out", manifest.held_out_trajectories);
    view.commit();
}

bool is_dataset_view(const std::filesystem::path& path) {
    try {
        return h5::Reader(path, view_format).has("dataset/plan");
    } catch (const std::runtime_error&) {
        return false;
    }
}

DatasetManifest read_dataset_manifest(const std::filesystem::path& path) {
    const h5::Reader file(path, view_format);
    return {.key = file.text_attribute("/", dataset_label),
            .plan = file.read_text("dataset/plan"),
            .shards = parse_checksum_list(file, file.read_text("dataset/shards")),
            .train_trajectories = file.read<int>("dataset/split/train", {h5::any}),
            .held_out_trajectories = file.read<int>("dataset/split/held_out", {h5::any}),
            .variety = file.read_text("dataset/variety")};
}

}  // namespace nbd

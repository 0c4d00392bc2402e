#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string>

#include "apps/check/check_file.hpp"
#include "apps/dataset/hold_out.hpp"
#include "apps/dataset/plan.hpp"
#include "meshing/h5/reader.hpp"
#include "meshing/h5/sha256.hpp"
#include "meshing/progress/progress.hpp"
#include "training/files/recording_format.hpp"

namespace nbd {

void check_shards(const std::filesystem::path& view, const DatasetManifest& manifest) {
    const double all = manifest.shards.size();
    for (double done = 0; const DatasetShard& shard : manifest.shards) {
        tell_progress("files", done++, all);
        if (const std::string is = h5::file_sha256(view.parent_path() / shard.file); is != shard.sha256)
            throw std::runtime_error(
                fmt::format("{}: shard {} has SHA-256 {}; allowed: {}, as in the manifest", view.string(),
                            shard.file, is, shard.sha256));
    }
}

namespace {

using Json = nlohmann::ordered_json;

class DatasetCheck {
 public:
    explicit DatasetCheck(const RecordingReader& view)
        : view_(view), manifest_(read_dataset_manifest(view.path())) {
        for (const TrajectoryInfo& info : view.trajectories())
            if (info.failure.empty() && info.frames > 0) complete_[info.id] = info.recipe;
    }

    void run() const {
        check_plan();
        check_copies();
        check_split(manifest_.split(trajectory_split));
        for (const DatasetSplit& split : manifest_.splits) {
            check_split(split);
            check_rule(split);
        }
        check_obstacles();
        check_shards(view_.path(), manifest_);
    }

 private:
    template <class... Args>
    [[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) const {
        throw std::runtime_error(
            fmt::format("{}: {}", view_.path().string(), fmt::format(format, std::forward<Args>(args)...)));
    }

    Json parsed(const std::string& text, const char* what) const {
        Json json = Json::parse(text, nullptr, false);
        if (!json.is_object()) refuse("{} is no JSON object; allowed: one, as nbdtree writes it", what);
        return json;
    }

    void check_plan() const {
        const Json plan = parsed(manifest_.plan, "'dataset/plan'");
        if (const std::string key = plan_key(manifest_.plan); key != manifest_.key)
            refuse("'dataset/plan' has SHA-256 {}; allowed: {}, the key of the dataset", key, manifest_.key);
        const std::string body = plan.value("body_sha256", "");
        for (const TrajectoryInfo& info : view_.trajectories())
            if (info.body_hash != body)
                refuse("trajectory {} is of body {}; allowed: {}, the body of the plan", info.id,
                       info.body_hash, body);
        if (const int planned = plan.value("trajectories", 0); planned != std::ssize(view_.trajectories()))
            refuse("has {} trajectories; allowed: {}, as planned", view_.trajectories().size(), planned);
    }

    /// What the view copies must be what the shards hold, and every trajectory must be in one of them.
    void check_copies() const {
        std::map<int, int> places;
        for (int i = 0; const TrajectoryInfo& info : view_.trajectories()) places[info.id] = i++;
        for (const DatasetShard& shard : manifest_.shards) {
            const RecordingReader source(view_.path().parent_path() / shard.file);
            for (int i = 0; const TrajectoryInfo& info : source.trajectories()) {
                const auto place = places.find(info.id);
                if (place == places.end())
                    refuse("trajectory {} of shard {} is missing; allowed: all of its trajectories", info.id,
                           shard.file);
                const int v = place->second;
                const TrajectoryInfo& copy = view_.trajectories()[v];
                if (copy.recipe != info.recipe || copy.failure != info.failure || copy.seed != info.seed ||
                    copy.body_hash != info.body_hash || view_.times(v) != source.times(i) ||
                    view_.facts(v) != source.facts(i) || view_.nodes(v) != source.nodes(i) ||
                    view_.contents(v) != source.contents(i) ||
                    view_.contact_edge_offsets(v) != source.contact_edge_offsets(i))
                    refuse(
                        "trajectory {} differs from its shard {}; allowed: the same attributes, recipe, "
                        "times, counts and arrays",
                        info.id, shard.file);
                places.erase(place);
                ++i;
            }
        }
        if (!places.empty())
            refuse("trajectory {} is in no shard of the manifest; allowed: each in one",
                   places.begin()->first);
    }

    void check_split(const DatasetSplit& split) const {
        std::set<int> seen;
        for (const auto& [part, ids] : {std::pair("training", &split.train), {"held-out", &split.held_out}}) {
            if (!std::ranges::is_sorted(*ids))
                refuse("split '{}': the {} trajectories do not ascend; allowed: ascending ids", split.name,
                       part);
            for (const int id : *ids) {
                if (!complete_.contains(id))
                    refuse("split '{}' names trajectory {}; allowed: complete trajectories of the dataset",
                           split.name, id);
                if (!seen.insert(id).second)
                    refuse("split '{}' has trajectory {} twice; allowed: each in one part", split.name, id);
            }
        }
        for (const auto& [id, recipe] : complete_)
            if (!seen.contains(id))
                refuse("split '{}' lacks trajectory {}; allowed: all complete trajectories", split.name, id);
    }

    void check_rule(const DatasetSplit& split) const {
        const Json json = parsed(split.rule, "the rule of a split");
        DatasetSplit wanted;
        try {
            wanted = split_by_parameter(parse_hold_out(json.value("rule", "")), complete_);
        } catch (const std::invalid_argument& error) {
            refuse("split '{}': {}", split.name, error.what());
        }
        if (wanted.rule != split.rule)
            refuse("split '{}' has the rule {}; allowed: {}", split.name, split.rule, wanted.rule);
        for (const int id : split.train)
            if (std::ranges::binary_search(wanted.held_out, id))
                refuse(
                    "split '{}' trains on trajectory {}, which its rule {} holds out; allowed: by the rule",
                    split.name, id, json.value("rule", ""));
        if (split.held_out != wanted.held_out)
            refuse("split '{}' holds out other trajectories than its rule {}; allowed: by the rule",
                   split.name, json.value("rule", ""));
    }

    /// Obstacles of contact edges are the floor and the plates of the recipe.
    void check_obstacles() const {
        for (int i = 0; const TrajectoryInfo& info : view_.trajectories()) {
            const Json recipe = parsed(info.recipe, "the recipe of a trajectory");
            const int obstacles = recipe.contains("floor") + recipe.value("plates", Json::array()).size();
            if (view_.contents(i).contact_edges)
                for (const auto& frame : view_.read_contact_edges(i, 0, info.frames))
                    for (const ContactEdge& edge : frame)
                        if (edge.partner <= obstacle_partner(obstacles))
                            refuse(
                                "trajectory {} touches obstacle {}; allowed: {} obstacles, as in its recipe",
                                info.id, obstacle_partner(0) - edge.partner, obstacles);
            ++i;
        }
    }

    const RecordingReader& view_;
    DatasetManifest manifest_;
    std::map<int, std::string> complete_;  // recipes by ids
};

}  // namespace

void check_dataset(const RecordingReader& view) {
    try {
        DatasetCheck(view).run();
    } catch (const nlohmann::json::exception& error) {
        throw std::runtime_error(fmt::format("{}: a plan, rule or recipe is not as nbdtree writes it: {}",
                                             view.path().string(), error.what()));
    }
}

}  // namespace nbd

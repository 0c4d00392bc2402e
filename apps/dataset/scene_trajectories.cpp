#include "apps/dataset/scene_trajectories.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "collision/base/notice.hpp"
#include "meshing/body/body.hpp"
#include "meshing/body/rigid_body.hpp"
#include "meshing/h5/sha256.hpp"
#include "sim/scene/build_world.hpp"
#include "sim/scene/scene_check.hpp"
#include "sim/world/start_check.hpp"

namespace nbd {
namespace {

/// Why a world cannot start, after bodies were moved apart as the scene wants it; empty if it can. moved:
/// out, a line about each.
std::string why_no_start(const SceneSpec& spec, World& world, std::vector<std::string>& moved) {
    moved.clear();
    try {
        for (const StartMove& move : move_apart(spec, world))
            moved.push_back(moved_text(body_labels(spec)[move.body], move));
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    std::vector<std::string> obstacles;
    for (const SceneObstacle& obstacle : spec.obstacles) obstacles.push_back(obstacle.name);
    const StartVerdict verdict = judge_start(world, body_labels(spec), obstacles);
    if (verdict.refusal.empty()) return {};
    return verdict.faults.empty() ? verdict.refusal : verdict.faults.front().text;
}

/// What a body is made of, which must not be drawn where its poses are recorded.
void refuse_drawn(const nlohmann::json& body, int number) {
    const auto refuse = [&](const std::string& key) {
        throw std::invalid_argument(fmt::format(
            "bodies[{}].{}: has a variable, but the poses of this body are recorded, which must be the "
            "same body in all trajectories; allowed: none here, or to record another body",
            number, key));
    };
    for (const char* key : {"body", "surface", "tets", "meshing"})
        if (body.contains(key) && has_variable(body[key])) refuse(key);
    if (!body.contains("transform")) return;
    const nlohmann::json& transform = body["transform"];
    if (transform.is_object() &&
        (transform.contains("var") || has_variable(transform.value("scale", nlohmann::json()))))
        refuse("transform.scale");
}

}  // namespace

/// A trajectory whose values are drawn, and drawn again where its start intersects.
class SceneTrajectories::Started {
 public:
    Started(const SceneTrajectories& all, int index, int refinement)
        : all_(all), index_(index), refinement_(refinement) {
        for (int again = 0; again <= SceneDataset::redraws; ++again) {
            values_ = all.scene_.draw(all.config_.seed, index, again);
            std::string why;
            try {
                why = begin();
            } catch (const std::invalid_argument& error) {
                failure_ = error.what();
                return;
            } catch (const std::runtime_error& error) {
                failure_ = error.what();
                return;
            }
            if (why.empty()) return;
            world_.reset();
            refused_.push_back(std::move(why));
        }
        failure_ =
            fmt::format("the start intersects with all of {} draws: {}", refused_.size(), refused_.back());
    }

    std::string recipe() const { return all_.recipe_text(body_, values_, refused_, moved_); }
    int steps_per_frame() const { return refinement_ * time_.steps_per_frame; }

    TrajectoryResult run(const OnFrame& on_frame) {
        TrajectoryResult result;
        result.failure = failure_;
        if (!refused_.empty()) result.drawn_again = refused_.front();
        result.can_improve = world_.has_value();
        if (!moved_.empty()) result.moved = moved_.front();
        if (!world_) return result;
        for (const StartFault& fault : start_faults(*world_, labels_))
            if (fault.overlaps && result.start_fault.empty()) result.start_fault = fault.text;
        const double dt = time_.dt / refinement_;
        for (; result.frames < all_.frames_; ++result.frames) {
            int troubled = 0, contacts = 0;
            for (int step = 0; step < steps_per_frame(); ++step) {
                const WorldReport report = world_->step(dt);
                result.failure = report.failure;
                if (!result.failure.empty()) return result;
                troubled += spoils_pose(report.trouble);
                contacts = report.contacts;
            }
            on_frame({world_->time(), world_->state(body_).x, contacts, troubled, *world_, body_});
        }
        return result;
    }

 private:
    /// Builds the world of the values. Returns why it cannot start.
    std::string begin() {
        const NoNotices told;
        SceneSpec spec = all_.scene_of(values_);
        body_ = all_.recorded_in(spec, index_);
        std::vector<LoadedBody> bodies = all_.load(spec);
        make_trees(spec, bodies);
        spec = local_scene(std::move(spec), bodies, all_.origin_);
        time_ = spec.time;
        if (time_.statics) time_.dt = 1.0 / all_.frames_;  // all have as many increments
        labels_ = body_labels(spec);
        const bool resolves = std::exchange(spec.resolve_start, false);
        world_.emplace(build_world(spec, bodies));
        spec.resolve_start = resolves;
        return why_no_start(spec, *world_, moved_);
    }

    const SceneTrajectories& all_;
    int index_, refinement_;
    int body_ = 0;  // that is recorded
    SceneValues values_;
    std::vector<std::string> refused_, moved_, labels_;
    std::string failure_;
    SceneTime time_;
    std::optional<World> world_;
};

SceneTrajectories::SceneTrajectories(SceneTemplate scene, const SceneDataset& config)
    : scene_(std::move(scene)), config_(config) {
    // What would be noticed in every trajectory is told here, once.
    SceneSpec first = scene_of(scene_.draw(config.seed, 0));
    files_.load_recordings(first);
    for (const SceneObstacle& obstacle : first.obstacles) make_obstacle(obstacle);
    if (scene_.scene().contains("time") && has_variable(scene_.scene()["time"]))
        throw std::invalid_argument(
            "time: has a variable, but all trajectories have the same frames; allowed: none there");
    const NoNotices told;
    find_recorded(first);
    std::set<std::filesystem::path> inputs;
    std::vector<SceneValues> all = scene_.extremes(config.seed);
    all.push_back(scene_.draw(config.seed, 0));
    for (const SceneValues& values : all) {
        const SceneSpec spec = scene_of(values);
        check_recorded(values, spec);
        for (std::filesystem::path& input : scene_inputs(spec)) inputs.insert(std::move(input));
    }
    inputs_.assign(inputs.begin(), inputs.end());
    const std::vector<LoadedBody> bodies = load(first);
    for (const int b : recorded_)
        if (bodies[b].body != bodies[recorded_.front()].body)
            throw std::invalid_argument(fmt::format(
                "bodies[{}]: is made otherwise than bodies[{}], so their poses are not of one body; allowed: to name "
                "one whose poses are recorded (--body), or bodies of the same file and meshing",
                b, recorded_.front()));
    body_ = bodies[recorded_.front()].body;
    if (is_rigid(body_->tets))
        throw std::invalid_argument(fmt::format(
            "bodies[{}]: is rigid, so it has no poses to train on; allowed: to record a soft body (--body)",
            recorded_.front()));
    if (first.bodies[recorded_.front()].source == BodySource::body)
        body_file_ = first.bodies[recorded_.front()].file;
    origin_ = *local_scene(first, bodies).origin;
    for (const LoadedBody& loaded : bodies) nodes_ += loaded.body->tets.X.rows();
    frames_ = config.frames.value_or(first.time.frames);
}

void SceneTrajectories::find_recorded(const SceneSpec& spec) {
    std::vector<std::string> names;
    for (const SceneBody& body : spec.bodies) names.push_back(body.name);
    recorded_ = named(spec);
    if (recorded_.empty())
        throw std::invalid_argument(
            fmt::format("has no body \"{}\" whose poses could be recorded; allowed: {}", config_.body,
                        fmt::join(names, ", ")));
    name_ = names[recorded_.front()];
    entry_ = scene_.entries_of(scene_.draw(config_.seed, 0))[recorded_.front()];
}

std::filesystem::path SceneTrajectories::body_file(const std::filesystem::path& folder) const {
    if (!body_file_.empty()) return body_file_;
    std::filesystem::path file = folder / "body.h5";
    if (!std::filesystem::exists(file)) save_body(file, *body_);
    return file;
}

/// The bodies of a scene that have the name, or all.
std::vector<int> SceneTrajectories::named(const SceneSpec& spec) const {
    std::vector<int> bodies;
    for (int b = 0; b < std::ssize(spec.bodies); ++b)
        if (config_.body.empty() || config_.body == spec.bodies[b].name) bodies.push_back(b);
    return bodies;
}

/// The body that a trajectory records. Throws std::invalid_argument if the scene has none of the name.
int SceneTrajectories::recorded_in(const SceneSpec& spec, int index) const {
    const std::vector<int> bodies = named(spec);
    if (bodies.empty())
        throw std::invalid_argument(fmt::format("there is no body \"{}\" to be recorded", name_));
    return bodies[index % bodies.size()];
}

/// What holds for each scene of the template.
void SceneTrajectories::check_recorded(const SceneValues& values, const SceneSpec& spec) const {
    const std::vector<int> recorded = named(spec), entries = scene_.entries_of(values);
    if (recorded.empty())
        throw std::invalid_argument(
            fmt::format("has no body \"{}\" to be recorded (with {}); allowed: a count of 1 or more", name_,
                        values_text(values)));
    const nlohmann::json& bodies = scene_.scene()["bodies"];
    for (const int b : recorded) {
        refuse_drawn(bodies[entries[b]], b);
        for (const char* key : {"body", "surface", "tets", "meshing"})
            if (bodies[entries[b]].value(key, nlohmann::json()) !=
                bodies[entry_].value(key, nlohmann::json()))
                throw std::invalid_argument(fmt::format(
                    "bodies[{}]: is made otherwise than bodies[{}], so their poses are not of one body; allowed: to name "
                    "one whose poses are recorded (--body), or bodies of the same file and meshing",
                    entries[b], entry_));
        if (spec.bodies[b].placement.scale != 1)
            throw std::invalid_argument(fmt::format(
                "bodies[{}].transform.scale: is {}, but the poses of this body are recorded; allowed: 1, and "
                "meshing.scale for another size",
                b, spec.bodies[b].placement.scale));
    }
}

SceneSpec SceneTrajectories::scene_of(const SceneValues& values) const {
    try {
        return scene_.scene_with(values);
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("{} (with {})", error.what(), values_text(values)));
    }
}

std::vector<LoadedBody> SceneTrajectories::load(SceneSpec& spec) const {
    constexpr int many = 100;  // scenes, whose meshing may be drawn
    Output silent;
    silent.quiet = true;
    const std::scoped_lock lock(loading_);
    if (++loaded_ % many == 0) files_ = SceneFiles();
    std::vector<LoadedBody> bodies;
    files_.load_recordings(spec);
    for (const SceneBody& body : spec.bodies) bodies.push_back(files_.load(body, silent));
    return bodies;
}

Trajectory SceneTrajectories::start(int index, int refinement) const {
    const auto started = std::make_shared<Started>(*this, index, refinement);
    return {started->recipe(), started->steps_per_frame(),
            [started](const OnFrame& on_frame) { return started->run(on_frame); }};
}

std::string SceneTrajectories::recipe(int index) const {
    const SceneValues values = scene_.draw(config_.seed, index);
    const int body =
        scene_.has_counts() ? recorded_in(scene_of(values), index) : recorded_[index % recorded_.size()];
    return recipe_text(body, values, {}, {});
}

/// body: that is recorded.
std::string SceneTrajectories::recipe_text(int body, const SceneValues& values,
                                           const std::vector<std::string>& refused,
                                           const std::vector<std::string>& moved) const {
    nlohmann::ordered_json json{{"kind", "scene"}, {"body", body}, {"draw", refused.size()}};
    json["variables"] = nlohmann::ordered_json(values);
    if (!refused.empty()) json["refused_draws"] = refused;
    if (!moved.empty()) json["moved_at_start"] = moved;
    return json.dump();
}

std::vector<std::string> SceneTrajectories::variables() const {
    std::vector<std::string> names;
    for (const SceneVariable& variable : scene_.variables()) names.push_back(variable.name);
    return names;
}

void SceneTrajectories::add_to_plan(nlohmann::ordered_json& plan) const {
    plan["frames"] = frames_;
    plan["recorded"] = name_;
    plan["redraws"] = SceneDataset::redraws;
    for (const std::filesystem::path& input : inputs_)
        plan["files"].push_back({{"name", input.lexically_proximate(scene_.base()).generic_string()},
                                 {"sha256", h5::file_sha256(input)}});
    plan["scene"] = nlohmann::ordered_json::parse(without_comments(scene_.text()));
}

}  // namespace nbd

#include "apps/dataset/producer.hpp"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "apps/dataset/hold_out.hpp"
#include "apps/dataset/variety.hpp"
#include "collision/base/temporary_files.hpp"
#include "collision/query/self_query.hpp"
#include "meshing/h5/sha256.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "training/files/dataset_manifest.hpp"
#include "training/files/recording_format.hpp"
#include "training/files/split.hpp"

namespace nbd {
namespace {

// Bytes of the claims file: one per trajectory, one per shard, one for the view.
constexpr long first_shard_claim = 1L << 32, view_claim = 1L << 33;

/// Calls work(i) for all i in [0, count) from `workers` threads. After the first exception, starts no further
/// i and rethrows it. For a WorkLog, a loop of one task for each i; there must be one worker then.
void run_workers(int count, int workers, const std::function<void(int)>& work) {
    ForkJoin order(__FILE__, __LINE__);
    std::atomic<int> next = 0;
    std::exception_ptr failure;
    std::mutex mutex;
    const auto loop = [&] {
        try {
            for (int i = next++; i < count; i = next++) {
                const ForkJoin::Task task(order);
                work(i);
            }
        } catch (...) {
            const std::scoped_lock lock(mutex);
            if (!failure) failure = std::current_exception();
            next = count;
        }
    };
    std::vector<std::thread> threads;
    for (int t = 0; t < workers; ++t) threads.emplace_back(loop);
    for (std::thread& thread : threads) thread.join();
    if (failure) std::rethrow_exception(failure);
}

/// Maximum number of trajectories simulated at once, so that a process needs less than 2 GiB where they have
/// up to 50,000 nodes. Further threads share in these trajectories.
int at_a_time(Eigen::Index nodes) {
    constexpr double budget = 1.5e9, a_node = 25e3;  // bytes; a_node is measured with two bodies in contact
    return std::max(1, static_cast<int>(budget / (a_node * static_cast<double>(nodes))));
}

/// The recipe with the attempts added.
std::string with_attempts(const std::string& recipe, int steps_per_frame,
                          const nlohmann::ordered_json& failed) {
    nlohmann::ordered_json json = nlohmann::ordered_json::parse(recipe);
    json["steps_per_frame"] = steps_per_frame;
    if (!failed.empty()) json["failed_attempts"] = failed;
    return json.dump();
}

/// Counts the faces of one surface that intersect each other, in one pose after another.
class SelfIntersections {
 public:
    /// tree: of the surface, with exact bounds.
    explicit SelfIntersections(std::shared_ptr<const CollisionTree> tree)
        : posed_(std::move(tree), BoundKind::boxes) {}

    /// Pairs of faces without a common vertex that have a point in common, by exact tests of positions in
    /// single precision, from nodes as a recording has them. W: of the surface; nodes: [N, 3], metres.
    std::int32_t count(const Embedding& W, const Nodes& nodes) {
        const Vertices x = embedded(W, Nodes(nodes.cast<float>().cast<double>())).cast<float>();
        posed_.begin_pose(x);
        return query_.intersecting(posed_).size();
    }

 private:
    PosedTree posed_;
    SelfQuery query_;
};

/// Manifest of the existing view; empty if the view is missing or damaged, since it is then rewritten.
DatasetManifest standing_manifest(const std::filesystem::path& view) {
    try {
        return read_dataset_manifest(view);
    } catch (const h5::ReadError&) {
        throw;
    } catch (const std::runtime_error&) {
        return {};
    }
}

}  // namespace

Producer::Producer(Body body, const DatasetPlan& plan, ShardFolder folder, ProducerHooks hooks)
    : plan_(plan),
      plan_text_(plan_json(plan, body)),
      key_(plan_key(plan_text_)),
      body_hash_(body_hash(body)),
      body_(std::move(body)),
      source_(trajectory_source(plan, body_)),
      tree_(shared_exact_tree(body_.surface.X.cast<float>(), body_.surface.F)),
      folder_(std::move(folder)),
      claims_(folder_.claims()),
      hooks_(std::move(hooks)) {
    if (!plan_.extras.contact_edges) return;
    ExcitationConfig config = plan.excitation;
    config.own_surface = true;
    const World world = Excitation(body_, config).start(0);
    const double distance = world.thickness();
    contact_surface_ = std::make_shared<const ContactEdgeSurface>(
        tree_, body_.float_weights(), body_.surface.X.cast<float>(),
        ContactDistances{distance, std::min(distance, mean_edge(world.shape(0)))});
}

FrameContents Producer::contents() const {
    FrameContents contents{.tets = static_cast<int>(corner_tets(body_.tets).rows()),
                           .fields = plan_.extras.fields};
    if (contact_surface_) contents.contact_edges = contact_surface_->distances;
    return contents;
}

/// x: positions as recorded. finder: of this attempt, made for its first frame.
FrameExtras Producer::extras_of(const ExcitedFrame& frame, const Vertices& x, int index,
                                std::optional<ContactEdgeFinder>& finder) const {
    FrameExtras extras;
    add_fields(plan_.extras, frame.world.elastic(frame.body), frame.x, frame.world.contact_forces(frame.body),
               extras);
    if (!contact_surface_) return extras;
    const std::size_t bodies = frame.world.body_count();
    if (!finder) {
        std::vector<int> ids(bodies, unrecorded_partner);
        ids[0] = index;
        finder.emplace(std::vector(bodies, contact_surface_), std::move(ids),
                       std::vector(frame.world.obstacles().begin(), frame.world.obstacles().end()));
    }
    std::vector<Vertices> nodes{x};
    for (std::size_t b = 1; b < bodies; ++b) nodes.push_back(frame.world.state(b).x.cast<float>());
    extras.contact_edges = std::move(finder->find(nodes, frame.time).front());
    return extras;
}

void Producer::warn(const std::string& line) {
    const std::scoped_lock lock(speaking_);
    hooks_.warn(line);
}

void Producer::verify(const std::function<bool(int)>& mine) {
    const std::vector<DatasetShard> known = standing_manifest(folder_.view()).shards;
    for (int g = 0; g < folder_.shards(); ++g) {
        if (!mine(g)) continue;
        hooks_.stop_if_asked();
        const auto remove_broken = [&](const std::filesystem::path& path, int first, int end) {
            const std::string defect = shard_defect(path, key_, first, end);
            if (defect.empty()) return;
            warn(fmt::format("remaking a damaged file: {}", defect));
            std::filesystem::remove(path);
        };
        if (const auto held = claims_.wait_for(first_shard_claim + g, hooks_.stop_if_asked)) {
            const std::filesystem::path path = folder_.shard(g);
            if (std::filesystem::exists(path)) {
                const auto entry = std::ranges::find(known, folder_.relative(g), &DatasetShard::file);
                if (entry == known.end()) {
                    remove_broken(path, folder_.first(g), folder_.end(g));
                } else if (h5::file_sha256(path) != entry->sha256) {
                    warn(fmt::format(
                        "remaking a damaged file: {}: its SHA-256 is not {:.12}... as in the manifest",
                        path.string(), entry->sha256));
                    std::filesystem::remove(path);
                }
                continue;
            }
        }
        for (int i = folder_.first(g); i < folder_.end(g); ++i)
            if (const auto held = claims_.try_claim(i); held && std::filesystem::exists(folder_.part(i)))
                remove_broken(folder_.part(i), i, i + 1);
    }
}

void Producer::simulate(int index) {
    nlohmann::ordered_json failed = nlohmann::ordered_json::array();
    const int nodes = body_.tets.X.rows();
    for (int attempt = 1, refinement = 1;; ++attempt, refinement *= 2) {
        const Trajectory trajectory = source_->start(index, refinement);
        const int steps = trajectory.steps_per_frame;
        RecordingWriter writer(folder_.part(index), source_->origin());
        writer.label(dataset_label, key_);
        const TrajectoryInfo info{.id = index,
                                  .seed = plan_.excitation.seed,
                                  .body_hash = body_hash_,
                                  .recipe = with_attempts(trajectory.recipe, steps, failed),
                                  .failure = {},
                                  .frames = 0};
        const int handle = writer.begin_trajectory(info, nodes, contents());
        FrameFacts facts;
        SelfIntersections self(tree_);
        std::optional<ContactEdgeFinder> contact_edges;
        const auto on_frame = [&](const ExcitedFrame& frame) {
            hooks_.stop_if_asked();
            const Vertices x = frame.x.cast<float>();
            writer.add_frame(handle, frame.time, x, extras_of(frame, x, index, contact_edges));
            facts.contacts.push_back(frame.contacts);
            facts.troubled.push_back(frame.troubled);
            facts.self_intersections.push_back(self.count(body_.W, frame.x));
        };
        const TrajectoryResult result = trajectory.run(on_frame);
        const std::string& failure = result.failure;
        {
            const std::scoped_lock lock(speaking_);
            if (!result.start_fault.empty()) overlaps_[index] = result.start_fault;
            if (!result.drawn_again.empty()) drawn_again_[index] = result.drawn_again;
            if (!result.moved.empty()) moved_[index] = result.moved;
        }
        if (!failure.empty() && result.can_improve && attempt < plan_.attempts) {
            failed.push_back({{"steps_per_frame", steps}, {"failure", failure}});
            continue;
        }
        writer.end_trajectory(handle, failure, facts);
        writer.finish();
        if (!failure.empty()) warn(fmt::format("trajectory {} failed and is left out: {}", index, failure));
        return;
    }
}

/// A line each about the starts of all trajectories that were made here.
void Producer::tell_starts() {
    const auto tell = [&](std::map<int, std::string>& starts, const char* what) {
        const std::map<int, std::string> all = std::exchange(starts, {});
        if (all.empty()) return;
        const auto& [index, why] = *all.begin();
        warn(fmt::format("{} of the trajectories {}, the first is trajectory {}: {}", all.size(), what, index,
                         why));
    };
    tell(overlaps_, "begin with an overlap");
    tell(drawn_again_, "were drawn again, as their starts intersect");
    tell(moved_, "begin with bodies that were moved apart");
}

void Producer::make(int index, bool wait) {
    hooks_.stop_if_asked();
    if (folder_.has(index)) return;
    {
        const auto held = wait ? claims_.wait_for(index, hooks_.stop_if_asked) : claims_.try_claim(index);
        if (!held || folder_.has(index)) return;
        simulate(index);
    }
    finish_shard(folder_.shard_of(index));
    const std::scoped_lock lock(speaking_);
    hooks_.progress(folder_.count());
}

void Producer::finish_shard(int shard) {
    const std::scoped_lock lock(packing_);  // excludes our own threads; the claim excludes processes
    const auto held = claims_.wait_for(first_shard_claim + shard, hooks_.stop_if_asked);
    pack_shard(folder_, key_, source_->origin(), shard, [this](const std::string& line) { warn(line); });
}

void Producer::produce(const std::function<bool(int)>& mine, int threads, int start) {
    std::vector<int> wanted;
    for (int i = 0; i < folder_.trajectories(); ++i)
        if (const int index = (start + i) % folder_.trajectories(); mine(index)) wanted.push_back(index);
    // First the trajectories that no process has claimed; then, when our own are done, the others.
    for (const bool wait : {false, true})
        for (;;) {
            std::vector<int> missing;
            std::ranges::copy_if(wanted, std::back_inserter(missing),
                                 [&](int index) { return !folder_.has(index); });
            if (missing.empty()) return tell_starts();
            if (!wait) hooks_.progress(folder_.count());
            const int count = missing.size(),
                      workers = std::min({threads, count, at_a_time(source_->nodes())});
            run_workers(count, workers, [&](int i) {
                tbb::task_arena arena(std::max(1, threads / workers));
                arena.execute([&] { make(missing[i], wait); });
            });
            if (!wait) break;
        }
}

bool Producer::fits(int shard, const std::string& sha256, const std::string& wanted) {
    if (sha256 == wanted) return true;
    const std::string defect =
        shard_defect(folder_.shard(shard), key_, folder_.first(shard), folder_.end(shard));
    if (defect.empty()) return true;
    warn(fmt::format("remaking a damaged file: {}", defect));
    std::filesystem::remove(folder_.shard(shard));
    return false;
}

bool Producer::merge() {
    const auto held = claims_.wait_for(view_claim, hooks_.stop_if_asked);
    DatasetManifest old = standing_manifest(folder_.view());
    old.shards.resize(folder_.shards());

    DatasetManifest manifest;
    manifest.key = key_;
    manifest.plan = plan_text_;
    bool changed = old.key != key_;
    for (int g = 0; g < folder_.shards(); ++g) {
        hooks_.stop_if_asked();
        finish_shard(g);
        if (!std::filesystem::exists(folder_.shard(g))) return false;
        DatasetShard shard{folder_.relative(g), h5::file_sha256(folder_.shard(g))};
        const std::string& before = old.shards[g].sha256;
        if (!fits(g, shard.sha256, before)) return false;
        changed = changed || shard.sha256 != before;
        manifest.shards.push_back(std::move(shard));
    }
    remove_leftovers();
    if (!changed) return true;

    VarietyMeter meter(body_, static_cast<long>(plan_.trajectories) * plan_.excitation.frames);
    std::vector<int> complete;
    std::map<int, std::string> recipes;  // of complete trajectories
    for (int g = 0; g < folder_.shards(); ++g) {
        hooks_.stop_if_asked();
        const RecordingReader recording(folder_.shard(g));
        meter.add(recording);
        for (const TrajectoryInfo& info : recording.trajectories())
            if (info.failure.empty() && info.frames > 0) {
                complete.push_back(info.id);
                recipes[info.id] = info.recipe;
            }
    }
    const Variety variety = meter.report();
    manifest.variety = to_json(variety);
    if (const long spoilt = variety.all.frames_troubled; spoilt > 0)
        warn(
            fmt::format("{} of {} frames follow steps that went wrong, as with tetrahedra inside out; "
                        "training leaves them out (nbdtree train --troubled-frames keeps them)",
                        spoilt, variety.all.frames));
    const auto split = draw_held_out(complete, plan_.held_out_share, plan_.excitation.seed);
    manifest.train_trajectories = split.train;
    manifest.held_out_trajectories = split.held_out;
    if (!plan_.hold_out.empty() && !recipes.empty()) add_split_by_parameter(recipes, manifest);
    write_dataset_view(folder_.view(), manifest);
    return true;
}

void Producer::add_split_by_parameter(const std::map<int, std::string>& recipes, DatasetManifest& manifest) {
    try {
        manifest.splits.push_back(split_by_parameter(parse_hold_out(plan_.hold_out), recipes));
    } catch (const std::invalid_argument& error) {
        warn(fmt::format("{}; the dataset has no split '{}'", error.what(), parameter_split));
    }
}

void Producer::remove_leftovers() const {
    remove_abandoned(folder_.path() / "");
    remove_abandoned(folder_.view());
}

}  // namespace nbd

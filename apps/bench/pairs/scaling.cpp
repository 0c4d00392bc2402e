#include "apps/bench/pairs/scaling.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>

#include "apps/bench/measure/machine.hpp"
#include "apps/bench/measure/median.hpp"
#include "apps/bench/pairs/crowd.hpp"
#include "apps/bench/pairs/own_methods.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

std::vector<PairMethodEntry> methods_for(const BenchBody& body, const ScalingConfig& config) {
    std::vector<PairMethodEntry> methods;
    for (const BoundKind kind : raced_bounds(*body.tree)) methods.push_back(tree_method(kind));
    methods.push_back(lazy_boxes_method(config.cluster_faces));
    return methods;
}

/// Executor on `threads` threads of TBB, which last as long as the executor.
Executor on_threads(int threads) {
    if (threads == 1) return run_in_order;
    const std::size_t most = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    if (static_cast<std::size_t>(threads) > most)
        throw std::invalid_argument(
            fmt::format("cannot time a crowd on {} threads; allowed: 1 to {}", threads, most));
    const auto arena = std::make_shared<tbb::task_arena>(threads);
    return [arena](int count, const std::function<void(int)>& task) {
        arena->execute([&] { parallel_for(count, task, 1); });
    };
}

CrowdRow time_crowd(const std::string& method, int threads, Crowd& crowd, std::span<const Vertices> poses,
                    const RaceConfig& config) {
    CrowdRow row{.method = method, .bodies = static_cast<int>(poses.size()), .threads = threads};
    std::vector<double> update, query, total;
    const Stopwatch race_time;
    for (int round = 0; round <= config.rounds; ++round) {
        const Stopwatch watch;
        crowd.update(poses);
        const double updated = watch.microseconds();
        row.pairs = crowd.pairs();
        const double finished = watch.microseconds();
        if (round == 0) continue;  // warms up
        update.push_back(updated);
        query.push_back(finished - updated);
        total.push_back(finished);
        if (race_time.seconds() > config.max_seconds) break;
    }
    row.update_us = median(update);
    row.query_us = median(query);
    row.total_us = median(total);
    return row;
}

}  // namespace

std::vector<DepthRow> race_by_depth(const BenchBody& coarse, const BenchBody& body,
                                    const RecordingReader& recording, std::span<const FrameId> frames,
                                    const ScalingConfig& config, const ScalingProgress& progress) {
    std::vector<DepthRow> rows;
    for (const double depth : config.depths) {
        const auto scenes =
            make_scenes_of_depth(coarse, recording, frames, config.scenes, depth, config.seed);
        for (RaceRow& row : race(body, methods_for(body, config), scenes, config.race,
                                 [&](const std::string&method, double) {
                                     progress(fmt::format("depth {:g}, {}", depth, method));
                                 }))
            rows.push_back({depth, std::move(row)});
    }
    return rows;
}

std::vector<CrowdRow> race_crowds(const BenchBody& body, const RecordingReader& recording,
                                  std::span<const FrameId> frames, const ScalingConfig& config,
                                  const ScalingProgress& progress) {
    std::vector<Executor> executors;
    for (const int threads : config.threads) executors.push_back(on_threads(threads));
    std::vector<CrowdRow> rows;
    for (const int count : config.bodies) {
        const auto poses = crowd_poses(body, recording, frames, count, config.spacing, config.seed);
        const auto run = [&](const std::string& method, int threads, const std::unique_ptr<Crowd>& crowd) {
            rows.push_back(time_crowd(method, threads, *crowd, poses, config.race));
            progress(fmt::format("{} bodies, {}, {} threads", count, method, threads));
        };
        for (std::size_t i = 0; i < executors.size(); ++i)
            for (const BoundKind kind : raced_bounds(*body.tree))
                run(std::string(name(kind)), config.threads[i],
                    make_tree_crowd(body, kind, count, executors[i]));
        run(fmt::format("lazy boxes {}", config.cluster_faces), 1,
            make_lazy_boxes_crowd(body, config.cluster_faces, count));
    }
    return rows;
}

double crossover(std::span<const DepthRow> rows) {
    constexpr double never = std::numeric_limits<double>::infinity();
    std::vector<double> depths;
    for (const DepthRow& row : rows) depths.push_back(row.depth);
    std::ranges::sort(depths, std::greater());
    depths.erase(std::unique(depths.begin(), depths.end()), depths.end());
    double from = never;
    for (const double depth : depths) {  // deepest first
        double exact = never, learned = never;
        for (const DepthRow& row : rows)
            if (row.depth == depth && row.race.failure.empty() &&
                row.race.method != name(BoundKind::automatic))  // which is one of the two
                (row.race.exact ? exact : learned) =
                    std::min(row.race.exact ? exact : learned, row.race.total_us);
        if (!(exact < learned) || learned == never) break;
        from = depth;
    }
    return from;
}

std::string to_csv(std::span<const DepthRow> rows) {
    std::string text = fmt::format(
        "# {}, one "
        "thread\nfaces,depth,method,exact,update_us,query_us,total_us,pairs,missed,invented,recall\n",
        this_machine());
    for (const auto& [depth, r] : rows)
        text += fmt::format("{},{:g},{},{},{:.3f},{:.3f},{:.3f},{:.6g},{},{},{:.8g}\n", r.faces, depth,
                            r.method, r.exact ? 1 : 0, r.update_us, r.query_us, r.total_us, r.pairs, r.missed,
                            r.invented, r.recall());
    return text;
}

std::string to_csv(std::span<const CrowdRow> rows) {
    std::string text =
        fmt::format("# {}\nbodies,threads,method,update_us,query_us,total_us,pairs\n", this_machine());
    for (const CrowdRow& r : rows)
        text += fmt::format("{},{},{},{:.3f},{:.3f},{:.3f},{}\n", r.bodies, r.threads, r.method, r.update_us,
                            r.query_us, r.total_us, r.pairs);
    return text;
}

}  // namespace nbd

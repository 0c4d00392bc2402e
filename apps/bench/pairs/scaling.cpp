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
#include "apps/drawing/chart.hpp"
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

/// Chart with one line per method, from the points of the rows.
template <class Row, class Name, class Place>
Chart lines(std::span<const Row> rows, const Name& name, const Place& place) {
    Chart chart{.title = {},
                .x_label = {},
                .y_label = "update and query, us",
                .x_ticks = {},
                .panels = {{"", {}}},
                .columns = 1,
                .log_x = true};
    std::vector<Series>& all = chart.panels.front().series;
    for (const Row& row : rows) {
        auto series = std::ranges::find(all, name(row), &Series::label);
        if (series == all.end()) {
            const int category = static_cast<int>(all.size());
            all.push_back({name(row), category_colour(category), category_dash(category), {}});
            series = all.end() - 1;
        }
        series->points.push_back(place(row));
    }
    for (Series& series : all) std::ranges::sort(series.points, {}, &PagePoint::x);
    return chart;
}

Chart depth_lines(std::span<const DepthRow> rows, double (*x)(const DepthRow&)) {
    return lines(
        rows, [](const DepthRow& r) { return r.race.method; },
        [x](const DepthRow& r) {
            return PagePoint{x(r), r.race.total_us};
        });
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

Page by_depth(std::span<const DepthRow> rows) {
    Chart chart = depth_lines(rows, [](const DepthRow& r) { return 100 * r.depth; });
    chart.title = "Depth of penetration";
    chart.x_label = "distance that one body moves on after first contact, % of the radius";
    chart.log_x = false;
    for (const DepthRow& row : rows)
        if (std::ranges::find(chart.x_ticks, 100 * row.depth) == chart.x_ticks.end())
            chart.x_ticks.push_back(100 * row.depth);
    std::ranges::sort(chart.x_ticks);
    return to_page(chart);
}

Page by_pairs(std::span<const DepthRow> rows) {
    Chart chart = depth_lines(rows, [](const DepthRow& r) { return std::max(1.0, r.race.pairs); });
    chart.title = "Faces that touch";
    chart.x_label = "intersecting face pairs";
    double most = 10;
    for (const DepthRow& row : rows) most = std::max(most, row.race.pairs);
    for (double tick = 1; tick < 10 * most; tick *= 10) chart.x_ticks.push_back(tick);
    return to_page(chart);
}

Page by_bodies(std::span<const CrowdRow> rows) {
    Chart chart = lines(
        rows,
        [](const CrowdRow& r) {
            return r.threads == 1 ? r.method : fmt::format("{}, {} threads", r.method, r.threads);
        },
        [](const CrowdRow& r) {
            return PagePoint{static_cast<double>(r.bodies), r.total_us};
        });
    chart.title = "Many bodies";
    chart.x_label = "bodies";
    for (const CrowdRow& row : rows)
        if (std::ranges::find(chart.x_ticks, row.bodies) == chart.x_ticks.end())
            chart.x_ticks.push_back(row.bodies);
    std::ranges::sort(chart.x_ticks);
    return to_page(chart);
}

}  // namespace nbd

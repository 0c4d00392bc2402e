#include "apps/bench/pairs/race.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "apps/bench/measure/heap.hpp"
#include "apps/bench/measure/median.hpp"
#include "apps/bench/pairs/lazy_boxes.hpp"
#include "collision/base/stopwatch.hpp"
#include "collision/query/missing_pairs.hpp"

namespace nbd {
namespace {

/// A scene on one surface, with its reference pairs.
struct Stage {
    Vertices a, b;
    std::vector<FacePair> truth;
};

/// The arrays that methods read, written as by a simulator.
struct Stand {
    Vertices a, b, nodes_a, nodes_b;

    void enter(const Stage& stage, const TouchingScene& scene) {
        a = stage.a;
        b = stage.b;
        nodes_a = scene.a;
        nodes_b = scene.b;
    }
};

std::vector<Stage> set_up(const BenchBody& body, std::span<const TouchingScene> scenes) {
    LazyBoxes a(body.surface.X, body.surface.F), b = a;
    std::vector<Stage> stages(scenes.size());
    for (std::size_t s = 0; s < scenes.size(); ++s) {
        apply_embedding(body.surface.W, scenes[s].a, stages[s].a);
        apply_embedding(body.surface.W, scenes[s].b, stages[s].b);
        a.begin_pose(stages[s].a);
        b.begin_pose(stages[s].b);
        intersecting_faces(a, b, stages[s].truth);
    }
    return stages;
}

std::optional<double> stated_miss_rate(const BenchBody& body, const PairMethodEntry& entry) {
    if (!entry.bounds || entry.exact) return std::nullopt;
    const auto kind = entry.bounds == BoundKind::automatic ? BoundKind::learned_boxes : *entry.bounds;
    const auto calibration = body.tree->calibrations.find(kind);
    if (calibration == body.tree->calibrations.end()) return std::nullopt;
    return calibration->second.miss_rate;
}

RaceRow race_one(const BenchBody& body, const PairMethodEntry& entry, std::span<const Stage> stages,
                 std::span<const TouchingScene> scenes, const RaceConfig& config, Stand& stand) {
    RaceRow row{.method = entry.name,
                .exact = entry.exact,
                .answers = entry.answers,
                .reads_nodes = entry.reads_nodes,
                .faces = body.faces(),
                .scenes = static_cast<int>(stages.size()),
                .stated_miss_rate = stated_miss_rate(body, entry)};
    for (const Stage& stage : stages)
        row.pairs += static_cast<double>(stage.truth.size()) / static_cast<double>(stages.size());
    stand.enter(stages.front(), scenes.front());
    const std::size_t heap = heap_bytes();
    std::unique_ptr<PairMethod> method;
    try {
        method = entry.make(body);
    } catch (const std::exception& error) {
        row.failure = error.what();
        return row;
    }
    std::vector<double> update, query, total;
    const Stopwatch race_time;
    // Round 0 warms up.
    for (int round = 0; round <= config.rounds; ++round) {
        long missed = 0, invented = 0;
        for (std::size_t s = 0; s < stages.size(); ++s) {
            stand.enter(stages[s], scenes[s]);
            const Stopwatch watch;
            method->update({stand.a, stand.nodes_a}, {stand.b, stand.nodes_b});
            const double updated = watch.microseconds();
            const std::span<const FacePair> found = method->query();
            const double finished = watch.microseconds();
            if (entry.answers) {
                missed += missing_pairs(stages[s].truth, found);
                invented += missing_pairs(found, stages[s].truth);
            }
            if (round == 0) continue;
            update.push_back(updated);
            query.push_back(finished - updated);
            total.push_back(finished);
        }
        row.missed = std::max(row.missed, missed);
        row.invented = std::max(row.invented, invented);
        if (round == 0) row.bytes = heap_bytes() - heap;
        row.rounds = round;
        if (round > 0 && race_time.seconds() > config.max_seconds) break;
    }
    row.update_us = median(update);
    row.query_us = median(query);
    row.total_us = median(total);
    row.mean_us = mean(total);
    row.p95_us = quantile(total, 0.95);
    return row;
}

/// Throws if an exact method finds other pairs than the reference, since one of them must then be wrong.
void check_answers(const RaceRow& row) {
    if (row.exact && row.failure.empty() && row.missed + row.invented > 0)
        throw std::runtime_error(
            fmt::format("{} on {} faces missed {} face pairs and found {} wrong ones: it is not exact",
                        row.method, row.faces, row.missed, row.invented));
}

}  // namespace

std::vector<RaceRow> race(const BenchBody& body, const std::vector<PairMethodEntry>& methods,
                          std::span<const TouchingScene> scenes, const RaceConfig& config,
                          const std::function<void(const RaceRow&)>& done) {
    const std::vector<Stage> stages = set_up(body, scenes);
    Stand stand;
    std::vector<RaceRow> rows;
    for (const PairMethodEntry& entry : methods) {
        rows.push_back(race_one(body, entry, stages, scenes, config, stand));
        check_answers(rows.back());
        done(rows.back());
    }
    return rows;
}

std::size_t tree_bytes(const CollisionTree& tree) {
    const std::size_t before = heap_bytes();
    const CollisionTree copy = tree;  // shares the models
    const auto bytes = [](const auto& model) { return model ? model->bytes() : 0; };
    return heap_bytes() - before + bytes(tree.affine) + bytes(tree.boxes) + bytes(tree.learned_affine);
}

}  // namespace nbd

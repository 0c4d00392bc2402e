#include "apps/bench/pairs/race.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <numeric>
#include <random>
#include <stdexcept>

#include "apps/bench/measure/measure.hpp"
#include "apps/bench/pairs/lazy_boxes.hpp"
#include "collision/base/stopwatch.hpp"
#include "collision/geometry/face_pair_set.hpp"

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
    BoundKind kind = *entry.bounds;
    if (kind == BoundKind::automatic) kind = BoundKind::learned_affine;
    const auto calibration = body.tree->calibrations.find(kind);
    if (calibration == body.tree->calibrations.end()) return std::nullopt;
    return calibration->second.miss_rate;
}

/// What all methods of a race are asked: scenes on one surface, and the arrays that they are read from.
struct Course {
    std::span<const TouchingScene> scenes;
    std::vector<Stage> stages;
    Stand stand{};

    void enter(std::size_t scene) { stand.enter(stages[scene], scenes[scene]); }
};

/// A method in a race, with its times so far.
class Racer {
 public:
    /// Makes the method and lets it run once to warm up.
    Racer(const BenchBody& body, const PairMethodEntry& entry, Course& course)
        : course_(course),
          row_{.method = entry.name,
               .exact = entry.exact,
               .reads_nodes = entry.reads_nodes,
               .faces = body.faces(),
               .scenes = static_cast<int>(course.stages.size()),
               .stated_miss_rate = stated_miss_rate(body, entry)} {
        for (const Stage& stage : course.stages)
            row_.pairs += static_cast<double>(stage.truth.size()) / course.stages.size();
        course.enter(0);
        const std::size_t heap = heap_bytes();
        try {
            method_ = entry.make(body);
        } catch (const std::exception& error) {
            row_.failure = error.what();
            return;
        }
        for (std::size_t s = 0; s < course.stages.size(); ++s) run(s);
        row_.bytes = heap_bytes() - heap;
    }

    const std::string& name() const { return row_.method; }

    /// Share of its rounds, or of its time; 1: it has run them all.
    double share_done(const RaceConfig& config) const {
        if (!method_) return 1;
        const double rounds = static_cast<double>(row_.rounds) / config.rounds;
        return std::min(1.0, std::max(rounds, seconds_ / config.max_seconds));
    }

    void run_round() {
        const Stopwatch watch;
        for (std::size_t s = 0; s < course_.stages.size(); ++s) {
            const Times times = run(s);
            update_.push_back(times.updated);
            query_.push_back(times.finished - times.updated);
            total_.push_back(times.finished);
        }
        ++row_.rounds;
        seconds_ += watch.seconds();
    }

    RaceRow result() const {
        RaceRow row = row_;
        if (!method_) return row;
        row.missed = std::accumulate(missed_.begin(), missed_.end(), 0L);
        row.invented = std::accumulate(invented_.begin(), invented_.end(), 0L);
        row.update_us = median(update_);
        row.query_us = median(query_);
        row.total_us = median(total_);
        row.mean_us = mean(total_);
        row.p95_us = quantile(total_, 0.95);
        return row;
    }

 private:
    struct Times {
        double updated, finished;  // microseconds since the start of the update
    };

    Times run(std::size_t scene) {
        course_.enter(scene);
        const Stand& stand = course_.stand;
        const Stopwatch watch;
        method_->update({stand.a, stand.nodes_a}, {stand.b, stand.nodes_b});
        const double updated = watch.microseconds();
        const std::span<const FacePair> found = method_->query();
        const double finished = watch.microseconds();
        const std::vector<FacePair>& truth = course_.stages[scene].truth;
        missed_[scene] = std::max(missed_[scene], missing_pairs(truth, found));
        invented_[scene] = std::max(invented_[scene], missing_pairs(found, truth));
        return {updated, finished};
    }

    Course& course_;
    RaceRow row_;
    std::unique_ptr<PairMethod> method_;
    std::vector<double> update_, query_, total_;
    std::vector<long> missed_ = std::vector<long>(course_.stages.size()), invented_ = missed_;
    double seconds_ = 0;
};

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
                          const RaceProgress& progress) {
    Course course{.scenes = scenes, .stages = set_up(body, scenes)};
    std::deque<Racer> racers;
    const auto tell = [&](const std::string& name) {
        double done = 0;
        for (const Racer& racer : racers) done += racer.share_done(config);
        progress(name, done / static_cast<double>(methods.size()));
    };
    for (const PairMethodEntry& entry : methods) {
        racers.emplace_back(body, entry, course);
        tell(entry.name);
    }
    const auto runs = [&](const Racer& racer) { return racer.share_done(config) < 1; };
    // Each round has another order, so that no method always follows one that leaves it warm caches.
    std::vector<Racer*> order;
    for (Racer& racer : racers) order.push_back(&racer);
    std::mt19937 random(1);
    while (std::ranges::any_of(racers, runs)) {
        std::ranges::shuffle(order, random);
        for (Racer* racer : order)
            if (runs(*racer)) {
                racer->run_round();
                tell(racer->name());
            }
    }
    std::vector<RaceRow> rows;
    for (const Racer& racer : racers) {
        rows.push_back(racer.result());
        check_answers(rows.back());
    }
    return rows;
}

std::size_t tree_bytes(const CollisionTree& tree) {
    const std::size_t before = heap_bytes();
    const CollisionTree copy = tree;  // shares the models
    const auto bytes = [](const auto& model) { return model ? model->bytes() : 0; };
    return heap_bytes() - before + bytes(tree.affine) + bytes(tree.boxes) + bytes(tree.learned_affine);
}

Rows to_rows(const std::string& contact, std::span<const RaceRow> rows) {
    Rows table;
    for (const RaceRow& r : rows) {
        table.push_back({{"contact", contact},
                         {"faces", r.faces},
                         {"method", r.method},
                         {"exact", r.exact},
                         {"reads", r.reads_nodes ? "nodes" : "surface"},
                         {"scenes", r.scenes},
                         {"rounds", r.rounds},
                         {"update_us", r.update_us},
                         {"query_us", r.query_us},
                         {"total_us", r.total_us},
                         {"mean_us", r.mean_us},
                         {"p95_us", r.p95_us},
                         {"pairs", r.pairs},
                         {"missed", r.missed},
                         {"invented", r.invented},
                         {"recall", r.recall()},
                         {"stated_miss_rate", nullptr},
                         {"bytes", r.bytes},
                         {"failure", r.failure}});
        if (r.stated_miss_rate) table.back()["stated_miss_rate"] = *r.stated_miss_rate;
    }
    std::ranges::stable_sort(table, {}, [](const auto& r) {
        return std::pair(r["faces"].template get<int>(), r["total_us"].template get<double>());
    });
    return table;
}

}  // namespace nbd

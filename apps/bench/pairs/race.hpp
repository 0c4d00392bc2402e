#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/bench/measure/rows.hpp"
#include "apps/bench/pairs/pair_method.hpp"
#include "apps/bench/pairs/touching_scenes.hpp"

namespace nbd {

struct RaceConfig {
    int rounds = 15;         // maximum per method, each over all scenes
    double max_seconds = 3;  // per method; no new round starts after it, but one round is always completed
};

/// Times of a method for both bodies, medians over scenes and rounds, and the quality of its answers.
struct RaceRow {
    std::string method;
    bool exact = true, reads_nodes = false;  // as in PairMethodEntry
    int faces = 0;                           // of each body
    int scenes = 0, rounds = 0;
    double update_us = 0, query_us = 0, total_us = 0;
    double mean_us = 0, p95_us = 0;  // of the total: mean and 95th percentile
    double pairs = 0;                // intersecting pairs, mean per scene
    long missed = 0, invented = 0;   // pairs not found, and wrong pairs: of each scene in its worst round
    /// Calibrated miss rate of the tree's nodes; empty for bounds that do not miss, or without calibration.
    std::optional<double> stated_miss_rate{};
    std::size_t bytes = 0;  // memory of both bodies, without positions, faces and the shared tree
    std::string failure{};  // why a method could not run

    double recall() const { return pairs > 0 ? 1 - static_cast<double>(missed) / (pairs * scenes) : 1; }
};

/// Called when a method has run a round, with its name and the share of the race that is done; may throw.
using RaceProgress = std::function<void(const std::string& method, double share)>;

/// Times methods on one body. Before each timing, the pose is written to the arrays that methods read, as a
/// simulator would do. One thread; all methods exist at the same time and take turns, a round over all scenes
/// each, in another order every time, so that slow minutes of the machine hit all of them and none always
/// finds the caches as its neighbour left them. Lazy boxes give the reference pairs. Throws
/// std::runtime_error if an exact method finds other pairs.
std::vector<RaceRow> race(const BenchBody& body, const std::vector<PairMethodEntry>& methods,
                          std::span<const TouchingScene> scenes, const RaceConfig& config,
                          const RaceProgress& progress);

/// Memory of a tree with all its bounds, bytes; 0 if unknown.
std::size_t tree_bytes(const CollisionTree& tree);

/// One row each, of fewer faces first, then the fastest. contact: its kind, "light", "heavy" or "recorded".
Rows to_rows(const std::string& contact, std::span<const RaceRow> rows);

}  // namespace nbd

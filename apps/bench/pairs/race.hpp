#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "apps/bench/pairs/pair_method.hpp"
#include "apps/bench/pairs/touching_scenes.hpp"

namespace nbd {

struct RaceConfig {
    int rounds = 15;         // over all scenes, of each method, at most
    double max_seconds = 3;  // a method; rounds end when it is over, but one is always complete
};

/// What a method took for both bodies, medians over scenes and rounds, and how good its answers were.
struct RaceRow {
    std::string method;
    bool exact = true, answers = true, reads_nodes = false;  // as PairMethodEntry
    int faces = 0;                                           // of each body
    int scenes = 0, rounds = 0;
    double update_us = 0, query_us = 0, total_us = 0;
    double pairs = 0;               // mean a scene that intersect in truth
    long missed = 0, invented = 0;  // pairs not found, and found that are none; over all scenes
    std::size_t bytes = 0;          // that both bodies take beside positions, faces and the tree they share
    std::string failure{};          // why a method could not be raced

    double recall() const { return pairs > 0 ? 1 - static_cast<double>(missed) / (pairs * scenes) : 1; }
};

/// Races methods on one body. Before each pose is timed it is written into the arrays that methods read from,
/// as a simulator would; one thread, methods one after another, round after round over all scenes. Truth is
/// what lazy boxes find. done: called after each method with its row. Throws
/// std::runtime_error where an exact method answers otherwise.
std::vector<RaceRow> race(const BenchBody& body, const std::vector<PairMethodEntry>& methods,
                          std::span<const TouchingScene> scenes, const RaceConfig& config,
                          const std::function<void(const RaceRow&)>& done);

/// What a body's tree takes, with all bounds it has, bytes; 0: not known.
std::size_t tree_bytes(const CollisionTree& tree);

}  // namespace nbd

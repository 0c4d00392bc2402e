#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "apps/bench/measure/rows.hpp"
#include "collision/continuous/feature_pair.hpp"

namespace nbd {

/// Queries of one kind from one scene, with their exact answers.
struct ImpactQueries {
    std::string scene;
    FeatureKind kind = FeatureKind::vertex_face;
    std::vector<std::array<MovingPoint, 4>> queries{};  // vertex and corners of the face, or both edges' ends
    std::vector<char> collides{};                       // [queries]
};

/// Reads queries in the format of [WangEtAl21]: FOLDER/SCENE/{edge-edge,vertex-face}/*.csv, eight rows a
/// query, four corners at the begin and four at the end; numerator and denominator of x, y and z, and the
/// answer. Scenes and files in order of their names. Throws std::runtime_error, with file and line, for a row
/// of another form or a folder without queries. Coordinates are rounded to double precision.
std::vector<ImpactQueries> read_impact_queries(const std::filesystem::path& folder);

/// Compares answers with the known ones: scene, kind, queries, collisions (in truth), missed and false_alarms
/// (wrong answers), exhausted (searches that ran out of iterations), ns (median time of a query over
/// repetitions), iterations (closest points a query, mean) and most_iterations.
Rows score_impacts(std::span<const ImpactQueries> queries);

/// Random motion: corners begin and end anywhere in a unit cube, and collide within a random distance.
struct RandomImpacts {
    long queries = 0, collisions = 0;  // found by sampling: certain
    long missed = 0, late = 0;         // no hit, or a time after the first sample that is too near
    long reported = 0, exhausted = 0;  // hits; searches that ran out of iterations
    double early = 0;                  // mean time by which hits are reported before that sample
};

/// Compares `count` queries with `samples` distances over the motion. done: called now and then with the
/// number of queries so far; may throw.
RandomImpacts check_random_impacts(long count, int samples, std::uint64_t seed,
                                   const std::function<void(long)>& done);

}  // namespace nbd

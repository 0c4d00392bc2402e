#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "apps/bench/exactness/exactness.hpp"

namespace nbd {

/// Answers of queries of one body with itself, in one kind of poses.
struct SelfExactnessRow {
    WildPose pose;
    int faces = 0, scenes = 0;
    long pairs = 0;                   // in the references
    long queries = 0, different = 0;  // answers compared, and those that differ from the reference
    double reference_ms = 0;          // an answer of the reference, mean
    double walk_ms = 0;               // an answer of `boxes`, pose included, mean
    double proof_ms = 0;              // a NeighbourProof, mean
    double proved = 0;                // share of the leaves that it proved apart from their neighbours, mean
    double proved_walk_ms = 0;        // an answer of `boxes` that uses it, pose included, mean
    double tests_per_face = 0;        // pairs of nodes and of boxes compared by `boxes`, mean
};

/// Asks for faces of a twisted, crushed, folded or bent body that intersect each other, and in every fourth
/// pose of a kind for those within a distance, with the bounds `exact`, `boxes` and `affine`, and with
/// `boxes` and a NeighbourProof; compares the sets with swept_pairs(), of which those with a common vertex
/// are left out. done: as in check_exactness(), and so for the body.
std::vector<SelfExactnessRow> check_self_exactness(const BenchBody& body, const ExactnessConfig& config,
                                                   const std::function<void(int)>& done);

/// One line per row: bodies and their rows, in order.
std::string to_csv(std::span<const std::string> bodies, std::span<const std::vector<SelfExactnessRow>> rows);

}  // namespace nbd

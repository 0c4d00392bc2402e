#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "apps/bench/exactness/wild_poses.hpp"
#include "apps/bench/pairs/bench_body.hpp"

namespace nbd {

struct ExactnessConfig {
    int scenes = 100;  // of each body, divided among the kinds of wild poses
    std::uint64_t seed = 1;
};

/// Answers of all exact bounds, in scenes of two copies of a body in one kind of wild poses.
struct ExactnessRow {
    WildPose pose;
    int faces = 0;                    // of each body
    int scenes = 0, touching = 0;     // scenes, and those whose reference is not empty
    long pairs = 0;                   // in the references
    long queries = 0, different = 0;  // answers compared, and those that differ from the reference
    std::string first_difference{};   // which bounds and kernels, in which scene
};

/// Asks for intersecting faces, and in every fourth scene for those within a distance, with all exact bounds,
/// mixed pairs of them included, and all kernels of this machine; compares the sets with swept_pairs(). The
/// bodies' boxes overlap more and more until faces intersect. done: called after each scene with the number
/// of scenes so far; may throw. The body's surface must hang on its nodes with weights >= 0.
std::vector<ExactnessRow> check_exactness(const BenchBody& body, const ExactnessConfig& config,
                                          const std::function<void(int)>& done);

/// One line per row: bodies and their rows, in order.
std::string to_csv(std::span<const std::string> bodies, std::span<const std::vector<ExactnessRow>> rows);

}  // namespace nbd

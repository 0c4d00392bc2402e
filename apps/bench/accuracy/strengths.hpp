#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/bench/accuracy/accuracy.hpp"

namespace nbd {

/// Bounds of a tree on the dataset that it was trained on, and how strong the dataset's motion is.
struct StrengthSet {
    std::string name;         // of the tree's file
    std::uint64_t seed = 0;   // of the dataset
    double strength = 0;      // of its recipe
    double displacement = 0;  // root mean square without rigid motion, over the body's length
    double stretch_low = 1, stretch_high = 1;  // 1 % and 99 % quantiles of the elements' principal stretches
    double least_stretch = 1, largest_stretch = 1;
    std::vector<Accuracy> accuracy;
};

/// Throws std::runtime_error unless `data` is a dataset of `nbdtree dataset` with frames, and what
/// load_tree() and measure_accuracy() throw.
StrengthSet measure_strength(const std::filesystem::path& tree, const std::filesystem::path& data,
                             std::span<const BoundKind> bounds);

/// CSV: column names, then one line per tree, set of frames and bound.
std::string to_csv(const std::vector<StrengthSet>& sets);

}  // namespace nbd

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Which vertices of a node become its samples.
/// spread: far from each other at rest, whatever the poses.
/// support: most of them are those that stood farthest out in training poses, each chosen for what it adds to
/// the others; the rest spread. A sphere needs no others where the same few vertices are always its
/// farthest.
enum class SampleRule { spread, support };

/// "spread", "support".
std::string_view name(SampleRule rule) noexcept;

struct SamplesConfig {
    SampleRule rule = SampleRule::support;
    int count = 0;       // samples of a node, a multiple of 16 up to 128; 0: as few as `tolerance` takes
    int max_count = 64;  // where `tolerance` decides
    double tolerance = 0.001;  // mean relative error of the radius on the poses that samples are chosen from
    int exact_vertices = 32;   // nodes of at most so many vertices take them all; up to 128
    double spread_share = 0.25;  // of the samples, with `support`
    double side_weight = 0.25;   // of each side of the box against the radius, with `support`
    std::uint64_t seed = 1;
};

/// Throws std::invalid_argument naming the option that is out of range.
void check_samples_config(const SamplesConfig& config);

/// Samples of a node.
struct NodeSamples {
    std::vector<int> vertices;  // filled up to a multiple of 16 with the first one
    Eigen::VectorXf weights;    // of each in the centre; sum 1
    bool exact = false;         // they are all of the node's
};

/// Chooses a node's samples, and the affine combination of them that is nearest to the mean of its vertices
/// in the least-squares sense over `poses`. Same bits for the same arguments.
/// X: rest positions. poses: [n, 3] each, at least one. vertices: of the node, as SphereTree lists them.
NodeSamples choose_samples(VerticesRef X, std::span<const Vertices> poses, std::span<const int> vertices,
                           const SamplesConfig& config);

}  // namespace nbd

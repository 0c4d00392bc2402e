#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Rule for choosing a node's samples among its vertices.
/// spread: vertices far from each other at rest, whatever the poses.
/// support: mostly vertices that stand farthest out in training poses, each chosen for what it adds to the
/// others; the rest by `spread`. Best for spheres whose farthest vertices are always the same few.
enum class SampleRule { spread, support };

/// Name of a rule: "spread" or "support".
std::string_view name(SampleRule rule) noexcept;

struct SamplesConfig {
    SampleRule rule = SampleRule::support;
    int count = 0;             // samples per node, a multiple of 16 up to 128; 0: as few as `tolerance` needs
    int max_count = 64;        // upper limit if `tolerance` decides
    double tolerance = 0.001;  // mean relative radius error on the poses that samples are chosen from
    int exact_vertices = 32;   // nodes with at most this many vertices take them all; up to 128
    double spread_share = 0.25;  // share of spread samples under `support`
    double side_weight = 0.25;   // weight of each side of the box relative to the radius, under `support`
    std::uint64_t seed = 1;
};

/// Throws std::invalid_argument naming the option that is out of range.
void check_samples_config(const SamplesConfig& config);

/// Samples of a node.
struct NodeSamples {
    std::vector<int> vertices;  // padded to a multiple of 16 with the first one
    Eigen::VectorXf weights;    // of each sample in the centre; sum 1
    bool exact = false;         // true if the samples are all of the node's vertices
};

/// Chooses a node's samples and the weights of their affine combination that is closest to the mean of the
/// node's vertices, by least squares over `poses`. Same bits for the same arguments. X: rest positions.
/// poses: [n, 3] each, at least one. vertices: of the node, as listed by SphereTree.
NodeSamples choose_samples(VerticesRef X, std::span<const Vertices> poses, std::span<const int> vertices,
                           const SamplesConfig& config);

}  // namespace nbd

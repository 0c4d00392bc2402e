#pragma once

#include <span>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Rule for choosing the samples of a patch among its vertices.
/// spread: vertices far from each other at rest, whatever the poses.
/// support: mostly vertices that stand farthest out in training poses, each chosen for what it adds to the
/// others; the rest by `spread`.
enum class SampleRule { spread, support };

/// Chooses `count` samples of a patch, a multiple of 16. Of a patch with fewer vertices it takes all, and
/// fills up with the first to a multiple of 16. Same bits for the same arguments. X: rest positions. poses:
/// [n, 3] each, at least one; not read for `spread`. vertices: of the patch; a vertex that is listed more
/// often has more weight in the patch's mean.
std::vector<int> choose_samples(VerticesRef X, std::span<const Vertices> poses, std::span<const int> vertices,
                                SampleRule rule, int count);

}  // namespace nbd

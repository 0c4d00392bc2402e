#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "apps/bench/pairs/bench_body.hpp"
#include "collision/base/executor.hpp"
#include "training/files/recording.hpp"
#include "training/files/split.hpp"

namespace nbd {

/// Many copies of a body. update() takes one pose per copy; pairs() finds all intersecting faces of different
/// bodies, among pairs of bodies that the library's sweep over whole-body boxes finds close.
class Crowd {
 public:
    virtual ~Crowd() = default;
    virtual void update(std::span<const Vertices> poses) = 0;
    /// Number of intersecting face pairs, over all pairs of bodies.
    virtual long pairs() = 0;
};

/// A crowd of `count` bodies with bounds of the body's tree; uses ManyBodyQuery on the executor's threads.
std::unique_ptr<Crowd> make_tree_crowd(const BenchBody& body, BoundKind kind, int count,
                                       const Executor& executor = run_in_order);

/// A crowd of `count` bodies with lazy boxes, on one thread.
std::unique_ptr<Crowd> make_lazy_boxes_crowd(const BenchBody& body, int cluster_faces, int count);

/// Poses of a crowd: random frames with random rotations in a cubic grid, with `spacing` radii between
/// neighbours. frames: not empty.
std::vector<Vertices> crowd_poses(const BenchBody& body, const RecordingReader& recording,
                                  std::span<const FrameId> frames, int count, double spacing,
                                  std::uint64_t seed);

}  // namespace nbd

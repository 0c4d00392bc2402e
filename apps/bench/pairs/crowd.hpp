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

/// Many copies of a body: update() takes a pose each, pairs() finds all faces of different bodies that
/// intersect, after the library's sweep over the boxes around whole bodies has told which of them are near.
class Crowd {
 public:
    virtual ~Crowd() = default;
    virtual void update(std::span<const Vertices> poses) = 0;
    /// How many face pairs intersect, over all pairs of bodies.
    virtual long pairs() = 0;
};

/// With bounds of the body's tree, by ManyBodyQuery, on the threads that `executor` has. count: of bodies.
std::unique_ptr<Crowd> make_tree_crowd(const BenchBody& body, BoundKind kind, int count,
                                       const Executor& executor = run_in_order);

/// With lazy boxes, on one thread.
std::unique_ptr<Crowd> make_lazy_boxes_crowd(const BenchBody& body, int cluster_faces, int count);

/// Poses of a crowd: frames at random, each turned at random, in a cubic grid in which neighbours stand
/// `spacing` radii apart. frames: not empty.
std::vector<Vertices> crowd_poses(const BenchBody& body, const RecordingReader& recording,
                                  std::span<const FrameId> frames, int count, double spacing,
                                  std::uint64_t seed);

}  // namespace nbd

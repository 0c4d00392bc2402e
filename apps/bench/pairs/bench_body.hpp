#pragma once

#include <memory>

#include "collision/tree/collision_tree.hpp"
#include "training/files/surface_body.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {

/// A body as the benchmarks of collision queries see it: how its nodes move its surface, and a tree.
struct BenchBody {
    SurfaceBody surface;                        // without modes
    std::shared_ptr<const CollisionTree> tree;  // `exact` alone where none was trained
    TrainingSplit split;                        // of the tree's training; empty likewise
    int faces() const noexcept { return static_cast<int>(surface.F.rows()); }
};

/// A surface, of which the modes are dropped, with a tree of `exact` bounds.
BenchBody make_bench_body(SurfaceBody surface);

/// With a trained tree of the same body, see load_tree_of().
BenchBody make_bench_body(SurfaceBody surface, TreeFile tree);

/// The same body with its vertices in the order in which the tree's leaves have them: what is close in space
/// is close in memory. `certified` bounds are left out.
BenchBody in_tree_order(const BenchBody& body);

}  // namespace nbd

#pragma once

#include <memory>
#include <string>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "training/files/surface_body.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {

/// A body for the benchmarks of collision queries: its surface, how nodes move it, and a tree.
struct BenchBody {
    SurfaceBody surface;                        // without modes
    std::shared_ptr<const CollisionTree> tree;  // without learned bounds if no tree was trained
    TrainingSplit split;                        // of the tree's training; empty if no tree was trained
    int faces() const noexcept { return surface.F.rows(); }
};

/// Makes a body with a tree of bounds that need no training. Drops the modes.
BenchBody make_bench_body(SurfaceBody surface);

/// Makes a body with a trained tree of the same body, see load_tree_of(). Drops the modes.
BenchBody make_bench_body(SurfaceBody surface, TreeFile tree);

/// Loads bodies that share their tetrahedra, in the given order (coarsest surface first). files: for each
/// body, a body file and optionally a tree file trained on it. Throws std::runtime_error that names the file
/// if it cannot be read, a tree belongs to another body, or the tetrahedra differ from the first body's.
std::vector<BenchBody> load_bench_bodies(const std::vector<std::vector<std::string>>& files);

}  // namespace nbd

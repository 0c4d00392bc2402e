#include "apps/bench/pairs/bench_body.hpp"

#include <utility>

#include "apps/cli/load_body.hpp"

namespace nbd {
namespace {

/// Gives the tree affine bounds if the rest positions of the nodes are known. Drops the modes.
BenchBody with_affine_bounds(SurfaceBody surface, CollisionTree tree, TrainingSplit split) {
    surface.U.resize(0, 0);
    hang_on_solid(tree, surface);
    return {std::move(surface), std::make_shared<const CollisionTree>(std::move(tree)), std::move(split)};
}

}  // namespace

BenchBody make_bench_body(SurfaceBody surface) {
    CollisionTree tree = make_exact_tree(surface.X, surface.F);
    return with_affine_bounds(std::move(surface), std::move(tree), {});
}

BenchBody make_bench_body(SurfaceBody surface, TreeFile tree) {
    return with_affine_bounds(std::move(surface), std::move(tree.tree), std::move(tree.facts.split));
}

namespace {

BenchBody load(const std::vector<std::string>& files) {
    Body body = load_body(files.front());
    body.modes = {};
    SurfaceBody surface = surface_body(body);
    if (files.size() == 1) return make_bench_body(std::move(surface));
    TreeFile tree = load_tree_of(files[0], surface.hash, files[1]);
    return make_bench_body(std::move(surface), std::move(tree));
}

}  // namespace

std::vector<BenchBody> load_bench_bodies(const std::vector<std::vector<std::string>>& files) {
    std::vector<BenchBody> bodies;
    for (const std::vector<std::string>& names : files) {
        bodies.push_back(load(names));
        check_same_tets(names.front(), bodies.back().surface.solid, files.front().front(),
                        bodies.front().surface.solid);
    }
    return bodies;
}

}  // namespace nbd

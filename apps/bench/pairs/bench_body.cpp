#include "apps/bench/pairs/bench_body.hpp"

#include <utility>
#include <vector>

#include "apps/cli/load_body.hpp"

namespace nbd {
namespace {

/// New number of each vertex: in the order of the leaves, vertices without a face last.
std::vector<int> tree_order(const SphereTree& tree, int vertex_count) {
    std::vector<int> number(vertex_count, -1);
    int next = 0;
    for (const int v : tree.vertices)
        if (int& n = number[v]; n < 0) n = next++;
    for (int& n : number)
        if (n < 0) n = next++;
    return number;
}

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

BenchBody in_tree_order(const BenchBody& body) {
    const int n = body.surface.X.rows();
    const std::vector<int> number = tree_order(body.tree->spheres, n);
    const auto renumber = [&](auto begin, auto end) {
        for (; begin != end; ++begin) *begin = number[*begin];
    };
    BenchBody moved = body;
    std::vector<Eigen::Triplet<float>> weights;
    weights.reserve(body.surface.W.nonZeros());
    for (int v = 0; v < n; ++v) {
        const int to = number[v];
        moved.surface.X.row(to) = body.surface.X.row(v);
        for (SurfaceEmbedding::InnerIterator entry(body.surface.W, v); entry; ++entry)
            weights.emplace_back(to, entry.col(), entry.value());
    }
    moved.surface.W.setFromTriplets(weights.begin(), weights.end());
    Faces& F = moved.surface.F;
    renumber(F.data(), F.data() + F.size());

    CollisionTree tree = *body.tree;
    tree.faces = F;
    tree.boxes = make_boxes(tree);
    renumber(tree.spheres.vertices.begin(), tree.spheres.vertices.end());
    if (tree.learned_affine) {
        LearnedAffineFit fit = tree.learned_affine->fit();
        fit.X = moved.surface.X;
        renumber(fit.samples.begin(), fit.samples.end());
        renumber(fit.box_samples.begin(), fit.box_samples.end());
        tree.learned_affine = std::make_shared<const LearnedAffineModel>(tree.boxes->tree(), std::move(fit));
    }
    for (ClusteredModes* modes : {tree.bd ? &tree.bd->modes : nullptr, tree.nbd ? &tree.nbd->modes : nullptr})
        if (modes) renumber(modes->representatives.begin(), modes->representatives.end());
    return with_affine_bounds(std::move(moved.surface), std::move(tree), std::move(moved.split));
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

#include "apps/bench/pairs/load_bench_bodies.hpp"

#include <utility>

#include "apps/cli/load_body.hpp"

namespace nbd {
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

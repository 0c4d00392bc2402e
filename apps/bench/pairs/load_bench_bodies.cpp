#include "apps/bench/pairs/load_bench_bodies.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "apps/cli/load.hpp"

namespace nbd {
namespace {

SurfaceBody load_surface(const std::string& path) {
    Body body = load_body(path);
    body.modes = {};
    return surface_body(body);
}

BenchBody load(const std::vector<std::string>& files) {
    SurfaceBody surface = load_surface(files.front());
    if (files.size() == 1) return make_bench_body(std::move(surface));
    try {
        return make_bench_body(std::move(surface), load_tree(files[1]));
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(fmt::format("{} with {}: {}", files[0], files[1], error.what()));
    }
}

bool same_tets(const TetMesh& a, const TetMesh& b) {
    return a.X.rows() == b.X.rows() && a.T.rows() == b.T.rows() && a.X == b.X && a.T == b.T;
}

}  // namespace

std::vector<BenchBody> load_bench_bodies(const std::vector<std::vector<std::string>>& files) {
    std::vector<BenchBody> bodies;
    for (const std::vector<std::string>& names : files) {
        bodies.push_back(load(names));
        if (!same_tets(bodies.front().surface.solid, bodies.back().surface.solid))
            throw std::runtime_error(
                fmt::format("{}: its tetrahedra are not those of {}", names.front(), files.front().front()));
    }
    return bodies;
}

}  // namespace nbd

#include "sim/patches/contact_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <utility>

#include "sim/patches/surface_normals.hpp"

namespace nbd {
namespace {

/// Of a surface, for each node that carries it, from which on it is much finer than these.
constexpr Eigen::Index many_vertices = 12;

std::span<const int> nodes_of(const Embedding& W, int vertex) {
    const int *begin = W.outerIndexPtr(), *nodes = W.innerIndexPtr();
    return {nodes + begin[vertex], nodes + begin[vertex + 1]};
}

void append(IndexLists& lists, std::span<const int> items) {
    lists.items.insert(lists.items.end(), items.begin(), items.end());
}

ContactPatches make_patches(const Nodes& rest, const Embedding& W, const Faces& F,
                            const SurfaceTopology& topology) {
    const WideTree tree = build_wide_tree(rest.cast<float>(), F);
    ContactPatches patches;
    for (int leaf = 0; leaf < tree.leaves(); ++leaf) {
        const std::span<const int> faces(tree.faces.data() + ContactPatches::width * leaf,
                                         tree.faces_in[leaf]);
        for (const int face : faces)
            for (const int vertex : F.row(face)) {
                append(patches.nodes, nodes_of(W, vertex));
                if (topology.owner_of_vertex(vertex) == face) patches.vertices.items.push_back(vertex);
            }
        patches.vertices.end_set();
        patches.nodes.end_set();
    }
    const int count = patches.count();
    for (int patch = 0; patch < count; ++patch) {
        append(patches.of_block, patches.nodes[patch]);
        if ((patch + 1) % ContactPatches::width == 0 || patch + 1 == count) patches.of_block.end_set();
    }
    return patches;
}

}  // namespace

ContactShape::ContactShape(Embedding weights, Faces faces, NodesRef X)
    : W(std::move(weights)), F(std::move(faces)), topology([&] {
          if (W.cols() != X.rows() || W.rows() == 0 || F.rows() == 0)
              throw std::invalid_argument(fmt::format(
                  "contact surface: an embedding [{}, {}] and {} faces do not fit a body of {} nodes",
                  W.rows(), W.cols(), F.rows(), X.rows()));
          W.makeCompressed();
          return surface_topology(F, vertex_count());
      }()) {
    const Nodes rest = embedded(W, X);
    patches = make_patches(rest, W, F, topology);
    std::vector<char> carries(W.cols(), 0);
    for (const int node : std::span(W.innerIndexPtr(), W.nonZeros())) carries[node] = 1;
    is_much_finer = vertex_count() >= many_vertices * std::ranges::count(carries, 1);
    for (Eigen::Index v = 0; v < W.rows(); ++v) {
        double negative = 0;
        for (Embedding::InnerIterator entry(W, v); entry; ++entry) negative -= std::min(entry.value(), 0.0);
        overhang = std::max(overhang, negative);
    }
    rest_areas = vertex_areas(F, rest);
    cavities = cavities_of(rest, F);
    rest_diagonal = (rest.colwise().maxCoeff() - rest.colwise().minCoeff()).norm();
}

bool ContactShape::is_of(const Embedding& other_W, const Faces& other_F) const noexcept {
    const auto equal = [](const auto* a, const auto* b, Eigen::Index count) {
        return std::equal(a, a + count, b);
    };
    return F == other_F && W.rows() == other_W.rows() && W.cols() == other_W.cols() &&
           W.nonZeros() == other_W.nonZeros() && other_W.isCompressed() &&
           equal(W.outerIndexPtr(), other_W.outerIndexPtr(), W.rows() + 1) &&
           equal(W.innerIndexPtr(), other_W.innerIndexPtr(), W.nonZeros()) &&
           equal(W.valuePtr(), other_W.valuePtr(), W.nonZeros());
}

double mean_edge(const ContactShape& shape) noexcept {
    // Twice the area of a face is about the square of its edges' length.
    return std::sqrt(2 * shape.rest_areas.sum() / static_cast<double>(shape.F.rows()));
}

}  // namespace nbd

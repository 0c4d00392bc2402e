#include "sim/patches/contact_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <span>
#include <stdexcept>
#include <utility>

#include "sim/patches/contact_samples.hpp"

namespace nbd {
namespace {

ContactPatches make_patches(const WideTree* tree, const SurfaceTopology& topology, const Embedding& W,
                            FacesRef F, NodesRef X) {
    if (tree) return {*tree, topology};
    return {build_wide_tree(embedded(W, X).cast<float>(), F), topology};
}

std::span<const int> nodes_of(const Embedding& W, int vertex) {
    const int *begin = W.outerIndexPtr(), *nodes = W.innerIndexPtr();
    return {nodes + begin[vertex], nodes + begin[vertex + 1]};
}

void sort_out_repeats(std::vector<int>& items, std::ptrdiff_t from) {
    std::sort(items.begin() + from, items.end());
    items.erase(std::unique(items.begin() + from, items.end()), items.end());
}

}  // namespace

ContactShape::ContactShape(Embedding weights, Faces faces, NodesRef X, const WideTree* box_tree)
    : W(std::move(weights)),
      F(std::move(faces)),
      topology([&] {
          if (W.cols() != X.rows() || W.rows() == 0 || F.rows() == 0)
              throw std::invalid_argument(fmt::format(
                  "contact surface: an embedding [{}, {}] and {} faces do not fit a body of {} nodes",
                  W.rows(), W.cols(), F.rows(), X.rows()));
          W.makeCompressed();
          return surface_topology(F, vertex_count());
      }()),
      tree(box_tree),
      patches(make_patches(box_tree, topology, W, F, X)) {
    std::vector<int> vertices;
    for (int patch = 0; patch < patches.count(); ++patch) {
        const std::ptrdiff_t from = patch_nodes.items.size();
        vertices.clear();
        for (const int face : patches.faces[patch])
            for (int k = 0; k < 3; ++k) vertices.push_back(F(face, k));
        sort_out_repeats(vertices, 0);
        for (const int vertex : vertices) {
            const auto nodes = nodes_of(W, vertex);
            patch_nodes.items.insert(patch_nodes.items.end(), nodes.begin(), nodes.end());
        }
        sort_out_repeats(patch_nodes.items, from);
        patch_nodes.end_list();
    }
    constexpr int width = ContactPatches::width;
    for (int first = 0; first < patches.count(); first += width) {
        const std::ptrdiff_t from = block_nodes.items.size();
        for (int patch = first; patch < std::min(first + width, patches.count()); ++patch) {
            const auto nodes = patch_nodes[patch];
            block_nodes.items.insert(block_nodes.items.end(), nodes.begin(), nodes.end());
        }
        sort_out_repeats(block_nodes.items, from);
        block_nodes.end_list();
    }
    std::vector<bool> carries(W.cols(), false);
    for (const int node : std::span(W.innerIndexPtr(), W.nonZeros())) carries[node] = true;
    for (int node = 0; node < W.cols(); ++node)
        if (carries[node]) carriers.push_back(node);
    for (Eigen::Index v = 0; v < W.rows(); ++v) {
        double negative = 0;
        for (Embedding::InnerIterator entry(W, v); entry; ++entry) negative -= std::min(entry.value(), 0.0);
        overhang = std::max(overhang, negative);
    }
    const Nodes rest = embedded(W, X);
    rest_areas = vertex_areas(F, rest);
    ContactSamples samples = contact_samples(F, rest, rest_areas, carriers.size());
    for (int patch = 0; patch < patches.count(); ++patch) {
        std::ranges::copy_if(patches.vertices[patch], std::back_inserter(patch_samples.items),
                             [&](int v) { return samples.kept[v]; });
        patch_samples.end_list();
    }
    sample_areas = std::move(samples.areas);
    rest_diagonal = (rest.colwise().maxCoeff() - rest.colwise().minCoeff()).norm();
}

bool ContactShape::is_of(const Embedding& other_W, const Faces& other_F,
                         const WideTree* other_tree) const noexcept {
    const auto equal = [](const auto* a, const auto* b, Eigen::Index count) {
        return std::equal(a, a + count, b);
    };
    return tree == other_tree && F == other_F && W.rows() == other_W.rows() && W.cols() == other_W.cols() &&
           W.nonZeros() == other_W.nonZeros() && other_W.isCompressed() &&
           equal(W.outerIndexPtr(), other_W.outerIndexPtr(), W.rows() + 1) &&
           equal(W.innerIndexPtr(), other_W.innerIndexPtr(), W.nonZeros()) &&
           equal(W.valuePtr(), other_W.valuePtr(), W.nonZeros());
}

}  // namespace nbd

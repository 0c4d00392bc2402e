#include "sim/patches/contact_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>

#include "sim/patches/surface_normals.hpp"

namespace nbd {
namespace {

/// The things that each patch owns. owner: a face of each thing.
template <class Owner>
IndexLists owned(const std::vector<int>& of_face, int patches, int things, const Owner& owner) {
    const auto patch = [&](int i) { return of_face[owner(i)]; };
    IndexLists lists;
    lists.begin.assign(patches + 1, 0);
    for (int i = 0; i < things; ++i)
        if (owner(i) >= 0) ++lists.begin[patch(i) + 1];
    for (std::size_t p = 1; p < lists.begin.size(); ++p) lists.begin[p] += lists.begin[p - 1];
    lists.items.resize(lists.begin.back());
    std::vector<int> next(lists.begin.begin(), lists.begin.end() - 1);
    for (int i = 0; i < things; ++i)
        if (owner(i) >= 0) lists.items[next[patch(i)]++] = i;
    return lists;
}

}  // namespace

ContactPatches::ContactPatches(const WideTree& tree, const SurfaceTopology& topology)
    : of_face(topology.face_edges.rows()) {
    for (int leaf = 0; leaf < tree.leaves(); ++leaf) {
        for (int k = 0; k < tree.faces_in[leaf]; ++k) {
            const int face = tree.faces[width * leaf + k];
            faces.items.push_back(face);
            of_face[face] = leaf;
        }
        faces.end_list();
    }
    vertices = owned(of_face, count(), topology.vertex_begin.size() - 1,
                     [&](int vertex) { return topology.owner_of_vertex(vertex); });
    edges = owned(of_face, count(), topology.edges.rows(),
                  [&](int edge) { return topology.owner_of_edge(edge); });
}

namespace {

constexpr std::int64_t least_per_node = 12;
constexpr double least_per_cell = 16, cells_per_node = 4;
constexpr std::size_t kept_per_cell = 3;

/// The sum of the normals of each vertex's faces.
Nodes vertex_normals(const Faces& F, const Nodes& rest) {
    Nodes normals = Nodes::Zero(rest.rows(), 3);
    for (int face = 0; face < F.rows(); ++face) {
        const Eigen::RowVector3d normal = face_normal(F, rest, face);
        for (const int corner : F.row(face)) normals.row(corner) += normal;
    }
    return normals;
}

/// The cell of a vertex, and which of the six directions along the axes it faces most.
using Place = std::array<std::int64_t, 4>;

Place place_of(const Eigen::RowVector3d& x, const Eigen::RowVector3d& normal, double cell) {
    Eigen::Index axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    const auto index = [&](Eigen::Index i) { return static_cast<std::int64_t>(std::floor(x[i] / cell)); };
    return {index(0), index(1), index(2), 2 * axis + (normal[axis] < 0)};
}

/// The vertices of a group that are kept.
std::vector<int> most_spread(std::span<const int> group, const Nodes& rest, const Nodes& normals) {
    Eigen::RowVector3d outward = Eigen::RowVector3d::Zero();
    for (const int vertex : group) outward += normals.row(vertex);
    std::vector<int> kept;
    std::vector<double> distances(group.size(), std::numeric_limits<double>::infinity());
    std::size_t next = 0;
    for (std::size_t k = 1; k < group.size(); ++k)
        if (rest.row(group[k]).dot(outward) > rest.row(group[next]).dot(outward)) next = k;
    while (kept.size() < kept_per_cell && distances[next] > 0) {
        kept.push_back(group[next]);
        for (std::size_t k = 0; k < group.size(); ++k)
            distances[k] = std::min(distances[k], (rest.row(group[k]) - rest.row(kept.back())).squaredNorm());
        next = std::ranges::max_element(distances) - distances.begin();
    }
    return kept;
}

}  // namespace

bool is_much_finer(Eigen::Index vertices, std::size_t carriers) noexcept {
    return vertices >= least_per_node * static_cast<Eigen::Index>(carriers);
}

ContactSamples contact_samples(const Faces& F, const Nodes& rest, const Eigen::VectorXd& rest_areas,
                               int carriers) {
    const std::size_t count = rest.rows();
    const double per_node = static_cast<double>(rest.rows()) / std::max(carriers, 1),
                 per_cell = std::max(least_per_cell, per_node / cells_per_node),
                 cell = std::sqrt(per_cell * rest_areas.mean());
    if (!nbd::is_much_finer(rest.rows(), carriers) || !(cell > 0))
        return {std::vector<bool>(count, true), rest_areas};
    ContactSamples samples{std::vector<bool>(count, false), Eigen::VectorXd::Zero(rest.rows())};
    const Nodes normals = vertex_normals(F, rest);
    const Eigen::RowVector3d corner = rest.colwise().minCoeff();
    std::vector<Place> places(count);
    for (Eigen::Index v = 0; v < rest.rows(); ++v)
        places[v] = place_of(rest.row(v) - corner, normals.row(v), cell);
    std::vector<int> order;
    for (Eigen::Index v = 0; v < rest.rows(); ++v)
        if (rest_areas[v] > 0) order.push_back(v);
    const auto place = [&](int vertex) -> const Place& { return places[vertex]; };
    std::ranges::sort(order,
                      [&](int a, int b) { return place(a) != place(b) ? place(a) < place(b) : a < b; });
    for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
        while (end < order.size() && place(order[end]) == place(order[begin])) ++end;
        const auto group = std::span(order).subspan(begin, end - begin);
        const std::vector<int> kept = most_spread(group, rest, normals);
        for (const int vertex : kept) samples.kept[vertex] = true;
        for (const int vertex : group)
            samples.areas[*std::ranges::min_element(kept, {}, [&](int sample) {
                return (rest.row(sample) - rest.row(vertex)).squaredNorm();
            })] += rest_areas[vertex];
    }
    return samples;
}

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
    const auto append = [](IndexLists& lists, std::span<const int> items) {
        lists.items.insert(lists.items.end(), items.begin(), items.end());
    };
    for (int patch = 0; patch < patches.count(); ++patch) {
        for (const int face : patches.faces[patch])
            for (const int vertex : F.row(face)) append(patch_nodes, nodes_of(W, vertex));
        patch_nodes.end_set();
    }
    for (int patch = 0; patch < patches.count(); ++patch) {
        append(block_nodes, patch_nodes[patch]);
        if ((patch + 1) % ContactPatches::width == 0 || patch + 1 == patches.count()) block_nodes.end_set();
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
    is_much_finer = nbd::is_much_finer(vertex_count(), carriers.size());
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

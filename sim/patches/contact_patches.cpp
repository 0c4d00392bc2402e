#include "sim/patches/contact_patches.hpp"

namespace nbd {
namespace {

/// The things that each patch owns. owner: a face of each thing.
template <class Owner>
IndexLists owned(const std::vector<int>& of_face, int patches, int things, const Owner& owner) {
    const auto patch = [&](int i) { return of_face[owner(i)]; };
    IndexLists lists;
    lists.begin.assign(static_cast<std::size_t>(patches) + 1, 0);
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
    vertices = owned(of_face, count(), static_cast<int>(topology.vertex_begin.size()) - 1,
                     [&](int vertex) { return topology.owner_of_vertex(vertex); });
    edges = owned(of_face, count(), topology.edges.rows(),
                  [&](int edge) { return topology.owner_of_edge(edge); });
}

}  // namespace nbd

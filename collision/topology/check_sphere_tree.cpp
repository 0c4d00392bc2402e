#include <algorithm>
#include <cmath>
#include <utility>

#include "collision/base/requirement.hpp"
#include "collision/topology/sphere_tree.hpp"

namespace nbd {
namespace {

constexpr Requirement require("sphere tree");

void check_faces(const SphereTree& tree, int vertex_count, FacesRef F) {
    require(F.rows() > 0, "the surface has no faces");
    for (Eigen::Index f = 0; f < F.rows(); ++f)
        for (const int v : F.row(f))
            require(v >= 0 && v < vertex_count, "face ", f, " refers to vertex ", v, ", but the surface has ",
                    vertex_count, " vertices");
    const std::size_t count = F.rows();
    require(tree.faces.size() == count, "lists ", tree.faces.size(), " faces, but the surface has ", count);
    std::vector<char> seen(count, 0);
    for (const int f : tree.faces) {
        require(f >= 0 && f < F.rows(), "lists face ", f, ", but the surface has ", count, " faces");
        require(!std::exchange(seen[f], 1), "lists face ", f, " twice");
    }
}

void check_root(const SphereTree& tree) {
    require(!tree.nodes.empty(), "has no nodes");
    const SphereTree::Node& root = tree.nodes[0];
    require(root.depth == 0, "the root has depth ", root.depth, " instead of 0");
    require(root.face_begin == 0 && std::cmp_equal(root.face_end, tree.faces.size()), "the root owns faces ",
            root.face_begin, " to ", root.face_end, " of ", tree.faces.size());
    require(root.vertex_begin == 0 && std::cmp_equal(root.vertex_end, tree.vertices.size()),
            "the root owns vertices ", root.vertex_begin, " to ", root.vertex_end, " of ",
            tree.vertices.size());
}

/// Nodes must be in breadth-first order, and the ranges of two children must partition their parent's.
void check_nodes(const SphereTree& tree) {
    check_root(tree);
    std::size_t next = 1;
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
        const SphereTree::Node& node = tree.nodes[i];
        require(node.face_begin < node.face_end, "node ", i, " owns no face");
        require(node.vertex_begin < node.vertex_end, "node ", i, " owns no vertex");
        if (node.first_child == -1) continue;
        require(std::cmp_equal(node.first_child, next), "node ", i, " has its first child at ",
                node.first_child, ", allowed in breadth-first order: ", next, " or -1");
        require(next + 1 < tree.nodes.size(), "node ", i, " has children at ", next, " and ", next + 1,
                ", but there are ", tree.nodes.size(), " nodes");
        const SphereTree::Node &left = tree.nodes[next], &right = tree.nodes[next + 1];
        require(left.depth == node.depth + 1 && right.depth == node.depth + 1, "the children of node ", i,
                " have depths ", left.depth, " and ", right.depth, " instead of ", node.depth + 1);
        require(left.face_begin == node.face_begin && left.face_end == right.face_begin &&
                    right.face_end == node.face_end,
                "the children of node ", i, " do not partition its faces ", node.face_begin, " to ",
                node.face_end);
        require(left.vertex_begin == node.vertex_begin && left.vertex_end == right.vertex_begin &&
                    right.vertex_end == node.vertex_end,
                "the children of node ", i, " do not partition its vertices ", node.vertex_begin, " to ",
                node.vertex_end);
        next += 2;
    }
    require(next == tree.nodes.size(), "has ", tree.nodes.size(), " nodes, but the root reaches ", next);
}

/// Each leaf must list exactly the vertices of its faces, once each.
void check_vertices(const SphereTree& tree, int vertex_count, FacesRef F) {
    for (const int v : tree.vertices)
        require(v >= 0 && v < vertex_count, "lists vertex ", v, ", but the surface has ", vertex_count,
                " vertices");
    // Sized by the vertices in use: the number of vertices alone, of a damaged file, must not fill the
    // memory.
    const int in_use = 1 + std::max(F.size() > 0 ? F.maxCoeff() : -1,
                                    tree.vertices.empty() ? -1 : *std::ranges::max_element(tree.vertices));
    std::vector<int> listed_by(in_use, -1), used_by = listed_by;
    for (int i = 0; std::cmp_less(i, tree.nodes.size()); ++i) {
        if (!tree.nodes[i].is_leaf()) continue;
        for (const int v : tree.node_vertices(i))
            require(std::exchange(listed_by[v], i) != i, "leaf ", i, " lists vertex ", v, " twice");
        for (const int f : tree.node_faces(i))
            for (const int v : F.row(f)) {
                require(listed_by[v] == i, "leaf ", i, " does not list vertex ", v, " of its face ", f);
                used_by[v] = i;
            }
        for (const int v : tree.node_vertices(i))
            require(used_by[v] == i, "leaf ", i, " lists vertex ", v, ", but none of its faces uses it");
    }
}

void check_rest_spheres(const SphereTree& tree) {
    require(tree.rest.size() == tree.nodes.size(), "has ", tree.rest.size(), " rest spheres for ",
            tree.nodes.size(), " nodes");
    for (std::size_t i = 0; i < tree.rest.size(); ++i) {
        require(tree.rest[i].c.allFinite() && std::isfinite(tree.rest[i].r), "the rest sphere of node ", i,
                " is not finite");
        require(tree.rest[i].r >= 0, "the rest sphere of node ", i, " has a negative radius");
    }
}

}  // namespace

void check_sphere_tree(const SphereTree& tree, int vertex_count, FacesRef F) {
    require(vertex_count >= 0, "the surface has ", vertex_count, " vertices, allowed: 0 or more");
    check_faces(tree, vertex_count, F);
    check_nodes(tree);
    check_vertices(tree, vertex_count, F);
    check_rest_spheres(tree);
}

}  // namespace nbd

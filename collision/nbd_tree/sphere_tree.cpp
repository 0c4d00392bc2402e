#include "collision/nbd_tree/sphere_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/geometry/divide_faces.hpp"

namespace nbd {
namespace {

constexpr int max_depth = 20;
constexpr std::size_t ordered_faces = 4;  // splits inside a leaf stop at this many faces

void check_config(const SphereTreeConfig& config) {
    if (config.depth < 0 || config.depth > max_depth)
        throw std::invalid_argument(
            message("sphere tree depth is ", config.depth, ", allowed: 0 to ", max_depth));
    if (config.min_leaf_faces < 1)
        throw std::invalid_argument(
            message("sphere tree min_leaf_faces is ", config.min_leaf_faces, ", allowed: 1 or more"));
}

/// Orders the faces of a leaf by further splits, and the last few by index: the order inside the halves that
/// nth_element leaves depends on the standard library.
void order_leaf(std::span<int> faces, const FaceDivision& division) {
    if (faces.size() <= ordered_faces) {
        std::ranges::sort(faces);
        return;
    }
    division.split(faces, faces.size() / 2);
    order_leaf(faces.first(faces.size() / 2), division);
    order_leaf(faces.subspan(faces.size() / 2), division);
}

std::span<int> node_face_slots(SphereTree& tree, const SphereTree::Node& node) {
    return std::span(tree.faces).subspan(node.face_begin, node.face_end - node.face_begin);
}

void split_nodes(SphereTree& tree, const FaceDivision& division, const SphereTreeConfig& config) {
    tree.nodes.push_back({.face_end = static_cast<int>(tree.faces.size())});
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
        const SphereTree::Node node = tree.nodes[i];
        const int count = node.face_end - node.face_begin;
        if (node.depth == config.depth || count / 2 < config.min_leaf_faces) continue;
        division.split(node_face_slots(tree, node), static_cast<std::size_t>(count / 2));
        const int middle = node.face_begin + count / 2;
        tree.nodes[i].first_child = tree.nodes.size();
        tree.nodes.push_back({.depth = node.depth + 1, .face_begin = node.face_begin, .face_end = middle});
        tree.nodes.push_back({.depth = node.depth + 1, .face_begin = middle, .face_end = node.face_end});
    }
}

/// Fills the vertex lists of the leaves, in the order of their faces, then those of the inner nodes.
void list_vertices(SphereTree& tree, FacesRef F, Eigen::Index vertex_count) {
    std::vector<int> leaves;
    for (int i = 0; i < std::ssize(tree.nodes); ++i)
        if (tree.nodes[i].is_leaf()) leaves.push_back(i);
    std::ranges::sort(leaves, {}, [&](int i) { return tree.nodes[i].face_begin; });

    std::vector<int> last_leaf(vertex_count, -1);
    for (const int leaf : leaves) {
        SphereTree::Node& node = tree.nodes[leaf];
        node.vertex_begin = tree.vertices.size();
        for (const int f : tree.node_faces(leaf))
            for (const int v : F.row(f))
                if (std::exchange(last_leaf[v], leaf) != leaf) tree.vertices.push_back(v);
        node.vertex_end = tree.vertices.size();
    }
    for (std::size_t i = tree.nodes.size(); i-- > 0;) {
        SphereTree::Node& node = tree.nodes[i];
        if (node.is_leaf()) continue;
        const std::size_t child = node.first_child;
        node.vertex_begin = tree.nodes[child].vertex_begin;
        node.vertex_end = tree.nodes[child + 1].vertex_end;
    }
}

/// Orders the faces inside the leaves, then fills the vertex lists and rest spheres.
void fill_leaves(SphereTree& tree, VerticesRef X, FacesRef F, const FaceDivision& division) {
    for (const SphereTree::Node& node : tree.nodes)
        if (node.is_leaf()) order_leaf(node_face_slots(tree, node), division);
    list_vertices(tree, F, X.rows());
    tree.rest.clear();
    for (int i = 0; i < std::ssize(tree.nodes); ++i) {
        tree.rest.push_back(bounding_sphere(X, tree.node_vertices(i)));
        if (!tree.rest.back().c.allFinite() || !std::isfinite(tree.rest.back().r))
            throw std::invalid_argument(message("the surface is too large for float32: the sphere of node ",
                                                i, " overflows; positions should stay below 1e18 m"));
    }
}

/// Number of faces per node. Throws unless every face is assigned to a leaf and every leaf has a face.
std::vector<int> count_faces(const SphereTree& tree, std::span<const int> leaf_of_face) {
    std::vector<int> counts(tree.nodes.size(), 0);
    for (std::size_t f = 0; f < leaf_of_face.size(); ++f) {
        const int leaf = leaf_of_face[f];
        if (leaf < 0 || leaf >= std::ssize(tree.nodes) || !tree.nodes[leaf].is_leaf())
            throw std::invalid_argument(
                message("face ", f, " is assigned to node ", leaf, ", which is not a leaf"));
        ++counts[leaf];
    }
    for (std::size_t i = 0; i < tree.nodes.size(); ++i)
        if (tree.nodes[i].is_leaf() && counts[i] == 0)
            throw std::invalid_argument(message("leaf ", i,
                                                " gets no face: the surface is too coarse for "
                                                "the tree, or a different one"));
    return counts;
}

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

Sphere bounding_sphere(VerticesRef x, std::span<const int> vertices) noexcept {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int v : vertices) sum += x.row(v).transpose().cast<double>();
    const Eigen::Vector3f c = (sum / static_cast<double>(vertices.size())).cast<float>();
    float squared = 0;
    for (const int v : vertices) squared = std::max(squared, (x.row(v).transpose() - c).squaredNorm());
    // Each difference, square and sum rounds by half an ulp: 4 ulp cover them all.
    return {c, std::sqrt(squared) * (1 + 4 * std::numeric_limits<float>::epsilon())};
}

SphereTree build_sphere_tree(VerticesRef X, FacesRef F, const SphereTreeConfig& config) {
    check_config(config);
    FaceDivision division(X, F);
    SphereTree tree;
    tree.faces.assign(division.faces().begin(), division.faces().end());
    split_nodes(tree, division, config);
    fill_leaves(tree, X, F, division);
    return tree;
}

SphereTree sphere_tree_like(const SphereTree& like, std::span<const int> leaf_of_face, VerticesRef X,
                            FacesRef F) {
    const FaceDivision division(X, F);
    if (std::cmp_not_equal(leaf_of_face.size(), F.rows()))
        throw std::invalid_argument(
            message("leaf_of_face has ", leaf_of_face.size(), " entries, but the face count is ", F.rows()));
    const std::vector<int> counts = count_faces(like, leaf_of_face);
    SphereTree tree;
    tree.nodes = like.nodes;
    // Sorting by the old face ranges keeps the leaves in order.
    tree.faces.resize(leaf_of_face.size());
    std::iota(tree.faces.begin(), tree.faces.end(), 0);
    const auto begin_of = [&](int f) { return like.nodes[leaf_of_face[f]].face_begin; };
    std::ranges::stable_sort(tree.faces, {}, begin_of);
    for (std::size_t first = 0; first < tree.faces.size();) {
        const std::size_t leaf = leaf_of_face[tree.faces[first]];
        tree.nodes[leaf].face_begin = first;
        first += static_cast<std::size_t>(counts[leaf]);
        tree.nodes[leaf].face_end = first;
    }
    for (std::size_t i = tree.nodes.size(); i-- > 0;) {
        SphereTree::Node& node = tree.nodes[i];
        if (node.is_leaf()) continue;
        const std::size_t child = node.first_child;
        node.face_begin = tree.nodes[child].face_begin;
        node.face_end = tree.nodes[child + 1].face_end;
    }
    fill_leaves(tree, X, F, division);
    return tree;
}

void check_sphere_tree(const SphereTree& tree, int vertex_count, FacesRef F) {
    require(vertex_count >= 0, "the surface has ", vertex_count, " vertices, allowed: 0 or more");
    check_faces(tree, vertex_count, F);
    check_nodes(tree);
    check_vertices(tree, vertex_count, F);
    check_rest_spheres(tree);
}

}  // namespace nbd

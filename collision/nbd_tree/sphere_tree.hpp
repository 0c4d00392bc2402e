#pragma once

#include <span>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

struct SphereTreeConfig {
    int depth = 7;           // levels below the root; a full tree has 2^(depth + 1) - 1 nodes
    int min_leaf_faces = 4;  // a node with fewer than twice this many faces is not split
};

/// The project's only bounding-sphere rule: centre = mean of the listed vertices, radius = largest distance
/// from it. A vertex listed twice counts twice. The centre is linear in the positions, so the sphere follows
/// rigid motions exactly and never jumps, as labels for a regression need; a minimal ball would be a few
/// percent smaller, but it is not smooth.
/// x: all positions, [n, 3]. vertices: rows of x, not empty.
/// Returns a sphere that contains the listed vertices: the radius is rounded up by a few ulp.
Sphere bounding_sphere(VerticesRef x, std::span<const int> vertices) noexcept;

/// A binary tree over the faces of a surface, with a rest sphere per node. Wrapped hierarchy: a node's
/// sphere encloses the node's vertices, not its children's spheres [JamesPai04]. Enclosing the vertices
/// suffices: a ball that contains three points contains their triangle.
struct SphereTree {
    struct Node {
        int first_child = -1;                  // children are first_child and first_child + 1; -1: a leaf
        int depth = 0;                         // 0 at the root
        int face_begin = 0, face_end = 0;      // range of `faces`
        int vertex_begin = 0, vertex_end = 0;  // range of `vertices`
        bool is_leaf() const noexcept { return first_child < 0; }
    };
    std::vector<Node> nodes;    // breadth first: a parent precedes its children
    std::vector<int> faces;     // every face once; each node owns a contiguous range
    std::vector<int> vertices;  // vertex lists of the leaves, each without repeats; a vertex on the border of
                                // two leaves is in both lists. Each node owns the contiguous range of its
                                // leaves
    std::vector<Sphere> rest;   // one sphere per node, from bounding_sphere()

    std::span<const int> node_faces(int node) const noexcept {
        const Node& n = nodes[node];
        return std::span(faces).subspan(n.face_begin, n.face_end - n.face_begin);
    }
    std::span<const int> node_vertices(int node) const noexcept {
        const Node& n = nodes[node];
        return std::span(vertices).subspan(n.vertex_begin, n.vertex_end - n.vertex_begin);
    }
    int depth() const noexcept { return nodes.empty() ? 0 : nodes.back().depth; }
};

/// Builds a tree. Splits the faces at the median of their centroids along the longest side of the centroids'
/// box, ties by face index, until `depth` is reached or too few faces are left. Further splits order the
/// faces inside each leaf, so that halves of a leaf's range are compact down to a few faces. Deterministic.
/// X: rest positions [n, 3]; F: faces [m, 3], m >= 1. Throws std::invalid_argument on an empty surface,
/// an index out of range, a non-finite vertex, or a config out of range (depth 0 to 20).
SphereTree build_sphere_tree(VerticesRef X, FacesRef F, const SphereTreeConfig& config = {});

/// A tree of the same topology over another surface. leaf_of_face: for each face of F, the leaf of `tree`
/// that owns it. X, F: as in build_sphere_tree(). Throws std::invalid_argument on a surface that
/// build_sphere_tree() rejects, a number that is not a leaf, or a leaf without faces.
SphereTree sphere_tree_like(const SphereTree& tree, std::span<const int> leaf_of_face, VerticesRef X,
                            FacesRef F);

/// Validates a tree read from a file. Throws std::invalid_argument, saying what is wrong, unless `tree` is a
/// valid tree over a surface of `vertex_count` vertices and faces F.
void check_sphere_tree(const SphereTree& tree, int vertex_count, FacesRef F);

}  // namespace nbd

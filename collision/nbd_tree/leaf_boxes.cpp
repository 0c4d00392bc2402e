#include "collision/nbd_tree/leaf_boxes.hpp"

#include <algorithm>
#include <bit>
#include <utility>

namespace nbd {
namespace {

/// Number of halvings after which `count` faces fit a node.
int halvings(int count) noexcept {
    int n = 0;
    for (; count > LeafBoxes::max_boxes; count = (count + 1) / 2) ++n;
    return n;
}

}  // namespace

Box bounding_box(const VertexView& x, std::span<const int> vertices) noexcept {
    // Four independent chains, since each minimum waits for the previous one.
    constexpr int chains = 4;
    Box part[chains] = {empty_box(), empty_box(), empty_box(), empty_box()};
    Eigen::Array4f doubt[chains] = {};  // NaN where a number is not finite: minima lose it
    for (Eigen::Array4f& d : doubt) d.setZero();
    const auto add = [&](int c, int vertex) {
        const Eigen::Array4f p = x[vertex];
        part[c].lo = part[c].lo.min(p);
        part[c].hi = part[c].hi.max(p);
        doubt[c] += 0 * p;
    };
    const int *begin = vertices.data(), *end = begin + vertices.size();
    for (; end - begin >= chains; begin += chains)
        for (int c = 0; c < chains; ++c) add(c, begin[c]);
    for (; begin < end; ++begin) add(0, *begin);
    Box box = joined(joined(part[0], part[1]), joined(part[2], part[3]));
    const Eigen::Array4f any = (doubt[0] + doubt[1]) + (doubt[2] + doubt[3]);
    box.lo += any;
    box.hi += any;
    box.lo[3] = box.hi[3] = 0;
    return box;
}

LeafBoxes::LeafBoxes(const SphereTree& tree, const Faces& F, int vertex_count)
    : tree_(&tree), roots_(tree.nodes.size(), -1), corners_(F(tree.faces, Eigen::all)) {
    for (std::size_t leaf = 0; leaf < roots_.size(); ++leaf) {
        const SphereTree::Node& sphere_node = tree.nodes[leaf];
        if (!sphere_node.is_leaf()) continue;
        roots_[leaf] = nodes_.size();
        add_nodes(sphere_node.face_begin, sphere_node.face_end);
    }
    list_vertices(vertex_count);
    opened_.reserve(nodes_.size());
    at_.assign(nodes_.size(), 0);
}

void LeafBoxes::add_nodes(int face_begin, int face_end) {
    std::size_t next = nodes_.size();
    nodes_.push_back({.first_slot = face_begin, .count = face_end - face_begin});
    for (; next < nodes_.size(); ++next) {
        const Node whole = nodes_[next];
        const int left = halvings(whole.count);
        if (left == 0) continue;
        constexpr int most = std::bit_width(static_cast<unsigned>(LeafBoxes::max_boxes)) - 1;
        const int levels = (left + most - 1) / most;
        const int parts = 1 << (left + levels - 1) / levels;  // the same on all levels
        nodes_[next].first_child = nodes_.size();
        nodes_[next].count = parts;
        add_parts(next, whole.first_slot, whole.first_slot + whole.count, parts);
    }
}

/// Halves a range of faces into `parts` parts, a power of 2, and adds a node under `parent` for each.
void LeafBoxes::add_parts(int parent, int face_begin, int face_end, int parts) {
    if (parts == 1) {
        nodes_.push_back({.parent = parent, .first_slot = face_begin, .count = face_end - face_begin});
        return;
    }
    const int middle = face_begin + (face_end - face_begin) / 2;
    add_parts(parent, face_begin, middle, parts / 2);
    add_parts(parent, middle, face_end, parts / 2);
}

void LeafBoxes::list_vertices(int vertex_count) {
    // Children come after their parent and their faces are contiguous, so a backward pass finds the last
    // slots.
    std::vector<int> ends(nodes_.size());
    for (std::size_t i = nodes_.size(); i-- > 0;) {
        const Node& n = nodes_[i];
        ends[i] = n.has_faces() ? n.first_slot + n.count : ends[n.first_child + n.count - 1];
    }
    // Repeats are left out before sorting, which costs far more than this.
    std::vector<int> last_node(vertex_count, -1);  // that lists a vertex
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
        Node& n = nodes_[i];
        n.vertex_begin = vertices_.size();
        for (const int v : std::span(corners(n.first_slot), corners(ends[i])))
            if (std::exchange(last_node[v], static_cast<int>(i)) != static_cast<int>(i))
                vertices_.push_back(v);
        std::sort(vertices_.begin() + n.vertex_begin, vertices_.end());
        n.vertex_end = vertices_.size();
    }
}

void LeafBoxes::begin_step(const VertexView& start, const VertexView& end) noexcept {
    x_ = end;
    start_ = start;
    opened_.clear();
    met_non_finite_ = false;
}

Box LeafBoxes::whole(int i) const noexcept {
    const int parent = node(i).parent;
    return parent < 0 ? opened_[at(i)].whole : opened_[at(parent)].box(i - node(parent).first_child);
}

Box LeafBoxes::fit_to(const VertexView& x, const Node& n, std::array<BoxPack, 2>& packs) noexcept {
    const PosedFaces posed{&corners_, x};
    // Opening a root reads all of its vertices, so that nothing is left to be checked below.
    if (n.has_faces() && n.parent < 0) met_non_finite_ |= !is_finite(bounding_box(x, vertices_of(n)));
    Box all = empty_box();
    for (int k = 0; k < n.count; ++k) {
        Box box;
        if (n.has_faces()) {
            box = posed.box(n.first_slot + k);
        } else {
            box = bounding_box(x, vertices_of(node(n.first_child + k)));
            met_non_finite_ |= !is_finite(box);
        }
        packs[static_cast<std::size_t>(k / BoxPack::lanes)].set(k % BoxPack::lanes, box);
        all = joined(all, box);
    }
    all.lo[3] = all.hi[3] = 0;
    return all;
}

int LeafBoxes::fit(int i) noexcept {
    const Node& n = node(i);
    at_[i] = opened_.size();
    Opened& opened = opened_.emplace_back();
    opened.node = i;
    opened.count = x_.count() == 0 ? 0 : n.count;
    opened.whole = opened.count == 0 ? empty_box() : fit_to(x_, n, opened.packs);
    if (in_step()) {
        std::array<BoxPack, 2> at_start;
        opened.whole = joined(opened.whole, fit_to(start_, n, at_start));
        for (std::size_t k = 0; k < at_start.size(); ++k) opened.packs[k].join(at_start[k]);
    }
    return at(i);
}

}  // namespace nbd

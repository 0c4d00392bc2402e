#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "collision/base/aligned_vector.hpp"
#include "collision/geometry/box.hpp"
#include "collision/geometry/embedding.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/kernels/kernels.hpp"
#include "collision/kernels/packs.hpp"

namespace nbd {

/// Lists of nodes, around all of which boxes are made at once.
class NodeLists {
 public:
    NodeLists() = default;
    /// lists: places of the first coordinates of nodes. node_count: of all.
    NodeLists(std::span<const std::span<const std::int32_t>> lists, int node_count);

    /// Writes the box around each list; there is one at least. x: [node_count, 3]. Returns whether all
    /// numbers read are finite; if not, boxes mean nothing.
    bool boxes(const float* x, std::span<Box> boxes) const noexcept;

    std::size_t bytes() const noexcept;

 private:
    std::vector<std::int32_t> places_, counts_;  // see Kernels::boxes_of_lists
    std::vector<int> at_end_;  // lists with the last node of all, which no number may follow in memory
    int last_ = 0;             // its place
};

/// All numbers of some lists without repeats, ascending.
std::vector<int> distinct(std::span<const std::vector<int>> lists);

/// Parts of a surface that hangs on nodes, each with up to sixteen children, as the kernels read them.
class AffineParts {
 public:
    /// Largest number of nodes of a surface: three times as many are places of 32 bits.
    static constexpr int most_nodes = std::numeric_limits<std::int32_t>::max() / 3;

    /// How the children of a part are bounded: by an affine map, see Kernels, or around their own nodes. The
    /// part lists these (`nodes`), or each child is a part itself and lists its own (`own_parts`).
    enum class ChildBounds : std::uint8_t { map, nodes, own_parts };

    /// Vertices of the children of a part, or nodes that carry them; empty lists for those that are not
    /// present.
    using Children = std::array<std::vector<int>, 16>;

    /// Appends a part whose children are bounded around their nodes. carriers: nodes of the children, of one
    /// at least. bounds: not `map`.
    void add_around_nodes(const Children& carriers, ChildBounds bounds);
    /// Appends a part with a map. carriers: all nodes on which the vertices of each child hang. W: weights,
    /// [vertices, nodes]. rest: rest positions of the nodes.
    void add_map(const Children& children, const Children& carriers, const SurfaceEmbedding& W,
                 VerticesRef rest);
    /// Appends a part with a map whose nodes are some of its own vertices. No child is known to hang
    /// on them, so that its box may miss. samples: ascending, without repeats. carriers: of each child, among
    /// the samples. X: rest positions of the vertices.
    void add_map(const Children& children, const Children& carriers, std::span<const int> samples,
                 VerticesRef X);

    /// Nodes of a part without repeats, ascending, as places of their first coordinates.
    std::span<const int> nodes(int part) const noexcept {
        const Place& p = places_[part];
        return std::span(nodes_).subspan(p.nodes, p.node_count);
    }
    /// [16 * count] places of the nodes of the children: those of child k at k, k + 16 and so on, some more
    /// than once. Only for parts that list them.
    std::span<const std::int32_t> child_nodes(int part) const noexcept {
        const std::size_t begin = places_[part].child_nodes,
                          end = places_[static_cast<std::size_t>(part) + 1].child_nodes;
        return std::span(child_nodes_).subspan(begin, end - begin);
    }
    /// As the kernels take it; only for parts with a map.
    AffinePart part(int i) const noexcept;
    ChildBounds child_bounds(int part) const noexcept { return bounds_[part]; }
    /// Boxes of the children in the rest pose; only for parts with a map.
    const RestBoxes& rest_boxes(int part) const noexcept { return boxes_[places_[part].boxes]; }

    /// Prefetches all that a part holds.
    void prefetch(int part) const noexcept;

    /// Largest number of nodes of a part with a map.
    int max_nodes() const noexcept { return max_nodes_; }
    std::size_t bytes() const noexcept;

 private:
    /// rest_points(k, frame): vertices of child k at rest.
    template <class RestPoints>
    void add_fitted(const Children& carriers, std::vector<int> nodes, VerticesRef rest,
                    const RestPoints& rest_points);

    struct Place {
        std::size_t nodes = 0, node_count = 0, child_nodes = 0, carriers = 0, rest = 0, numbers = 0,
                    boxes = 0;
    };
    void add_nodes(std::span<const int> nodes);
    /// Ends the part that was appended.
    void end_part(ChildBounds bounds);

    std::vector<Place> places_{Place{}};  // [parts + 1] beginnings in the arrays below
    std::vector<ChildBounds> bounds_;
    std::vector<std::int32_t>
        nodes_;  // of parts with maps padded with repeats of the last one to a multiple of sixteen
    std::vector<std::int32_t> child_nodes_;
    std::vector<std::uint16_t> carriers_;
    std::vector<std::int16_t> rest_;
    std::vector<float> numbers_;  // moments, then reach
    AlignedVector<RestBoxes> boxes_;
    int max_nodes_ = 0, node_count_ = 0;
};

}  // namespace nbd

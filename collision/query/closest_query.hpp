#pragma once

#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "collision/geometry/closest_points.hpp"
#include "collision/tree/posed_tree.hpp"

namespace nbd {

class LeafBoxes;

/// Where two bodies come closest.
struct ClosestFaces {
    FacePair faces;
    ClosestPoints points;  // of the two triangles, see closest_triangle_triangle()
};

/// Distances between two posed trees: branch and bound. Pairs of nodes, of the boxes under leaves and of
/// faces wait in one queue, the pair that may be closest first, until none left can be closer than the
/// closest faces seen.
///
/// Owns the scratch, so that a warm query allocates nothing. One object a thread.
class ClosestQuery {
 public:
    /// The closest faces, where they are at most `most` apart (metres, >= 0): of equally close ones the
    /// first, of bodies that intersect any pair that does. With bounds that never miss on both sides this is
    /// exact; learned ones may hide the closest faces, so that others, further apart, are reported.
    std::optional<ClosestFaces> closest(PosedTree& a, PosedTree& b,
                                        double most = std::numeric_limits<double>::infinity()) noexcept;

    /// Pairs of faces whose distance the last query computed.
    long triangle_tests() const noexcept { return triangle_tests_; }

 private:
    /// A pair of sphere tree nodes, of LeafBoxes' nodes or of slots, and what they are at least apart,
    /// metres.
    struct Candidate {
        enum Level { faces, boxes, nodes };
        double distance;
        Level level;
        int a, b;
        auto operator<=>(const Candidate&) const = default;
    };

    void push(const Candidate& candidate) noexcept;
    Candidate pop() noexcept;
    void push_nodes(PosedTree& a, int node_a, PosedTree& b, int node_b) noexcept;
    /// Puts what a pair is made of in its place.
    void open_nodes(PosedTree& a, int node_a, PosedTree& b, int node_b) noexcept;
    void open_boxes(LeafBoxes& a, int node_a, LeafBoxes& b, int node_b) noexcept;
    void open_faces(LeafBoxes& a, int node_a, LeafBoxes& b, int node_b) noexcept;
    void test_faces(const LeafBoxes& a, int slot_a, const LeafBoxes& b, int slot_b) noexcept;

    std::vector<Candidate> queue_;
    double most_ = 0;                    // what is further apart is of no interest
    std::optional<FacePair> closest_;    // so far
    std::array<Triangle, 2> triangles_;  // of `closest_`
    long triangle_tests_ = 0;
};

}  // namespace nbd

#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <unordered_map>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Numbers distinct positions. Two positions are equal if all coordinates are bit-identical; -0 equals +0.
/// There is no tolerance: it would merge the vertices of a small mesh.
class PositionIndex {
 public:
    /// Returns the number of `x`; assigns the next free number if `x` is new.
    int insert(const Eigen::RowVector3d& x);

    /// The number of `x`, or -1 if absent.
    int find(const Eigen::RowVector3d& x) const noexcept;

    int size() const noexcept { return numbers_.size(); }

 private:
    using Key = std::array<std::uint64_t, 3>;
    struct Hash {
        std::size_t operator()(const Key& key) const noexcept;
    };
    static Key key(const Eigen::RowVector3d& x) noexcept;
    std::unordered_map<Key, int, Hash> numbers_;
};

/// Merges vertices at equal positions. The first of each is kept, in the original order. All faces are kept
/// in order, collapsed ones too. Indices must be in range.
TriMesh weld(const TriMesh& mesh);

/// What weld_within() did.
struct WeldReport {
    double length = 0;        // metres, as given
    int merged_vertices = 0;  // vertices that became one with another
    int dropped_faces = 0;    // faces that collapsed
    int split_edges = 0;      // open edges that were divided at a vertex on them
};

/// One line.
std::string describe(const WeldReport& report);

/// Closes cracks and T-junctions: merges vertices at most `length` apart, drops the faces that collapse, and
/// divides open edges at the open vertices that lie at most `length` beside them. A vertex moves to the first
/// vertex of the mesh within `length`, by at most that much. Everything else keeps its order and its bits.
/// Throws std::invalid_argument unless length is positive and finite. mesh: finite, indices in range.
TriMesh weld_within(const TriMesh& mesh, double length, WeldReport& report);

}  // namespace nbd

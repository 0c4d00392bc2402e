#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Numbers distinct positions. Two positions are the same when all coordinates are equal bit for bit, -0
/// and +0 counting as equal: a tolerance would merge the vertices of a small mesh.
class PositionIndex {
 public:
    /// The number of `x`, a new one (the next free) if it was not there.
    int insert(const Eigen::RowVector3d& x);

    /// The number of `x`, or -1.
    int find(const Eigen::RowVector3d& x) const noexcept;

    int size() const noexcept { return static_cast<int>(numbers_.size()); }

 private:
    using Key = std::array<std::uint64_t, 3>;
    struct Hash {
        std::size_t operator()(const Key& key) const noexcept;
    };
    static Key key(const Eigen::RowVector3d& x) noexcept;
    std::unordered_map<Key, int, Hash> numbers_;
};

/// The same faces over vertices that stand at distinct positions; of equal ones the first is kept, the rest
/// keep their order. Faces keep theirs, those that collapse included. Indices must be in range.
TriMesh weld(const TriMesh& mesh);

}  // namespace nbd

#include "meshing/surface/weld.hpp"

#include <bit>
#include <vector>

namespace nbd {

std::size_t PositionIndex::Hash::operator()(const Key& key) const noexcept {
    std::uint64_t h = 0x9e3779b97f4a7c15ull;
    for (const std::uint64_t k : key) {
        h = (h ^ k) * 0xff51afd7ed558ccdull;
        h ^= h >> 32;
    }
    return h;
}

PositionIndex::Key PositionIndex::key(const Eigen::RowVector3d& x) noexcept {
    const auto bits = [](double v) { return std::bit_cast<std::uint64_t>(v == 0 ? 0. : v); };
    return {bits(x[0]), bits(x[1]), bits(x[2])};
}

int PositionIndex::insert(const Eigen::RowVector3d& x) {
    return numbers_.try_emplace(key(x), size()).first->second;
}

int PositionIndex::find(const Eigen::RowVector3d& x) const noexcept {
    const auto found = numbers_.find(key(x));
    return found == numbers_.end() ? -1 : found->second;
}

TriMesh weld(const TriMesh& mesh) {
    PositionIndex index;
    std::vector<int> number(mesh.X.rows());
    TriMesh welded{Nodes(mesh.X.rows(), 3), Faces(mesh.F.rows(), 3)};
    for (int v = 0; v < mesh.X.rows(); ++v) {
        const int before = index.size(), n = index.insert(mesh.X.row(v));
        number[v] = n;
        if (n == before) welded.X.row(n) = mesh.X.row(v);
    }
    welded.X.conservativeResize(index.size(), 3);
    for (int f = 0; f < mesh.F.rows(); ++f)
        for (int c = 0; c < 3; ++c) welded.F(f, c) = number[mesh.F(f, c)];
    return welded;
}

}  // namespace nbd

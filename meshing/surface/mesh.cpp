#include "meshing/surface/mesh.hpp"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace nbd {

Faces boundary_faces(const TetMesh& tets) {
    // The faces of a positively oriented tetrahedron a b c d, counter-clockwise seen from outside.
    static constexpr int corners[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    using Key = std::array<int, 3>;
    std::vector<std::pair<Key, int>> sides;  // sorted corners, 4 * tet + local face
    sides.reserve(static_cast<std::size_t>(tets.T.rows()) * 4);
    for (int t = 0; t < tets.T.rows(); ++t)
        for (int k = 0; k < 4; ++k) {
            Key key = {tets.T(t, corners[k][0]), tets.T(t, corners[k][1]), tets.T(t, corners[k][2])};
            std::ranges::sort(key);
            sides.emplace_back(key, 4 * t + k);
        }
    std::ranges::sort(sides);
    std::vector<int> outer;
    for (std::size_t i = 0; i < sides.size();) {
        std::size_t j = i + 1;
        while (j < sides.size() && sides[j].first == sides[i].first) ++j;
        if (j == i + 1) outer.push_back(sides[i].second);
        i = j;
    }
    std::ranges::sort(outer);
    Faces F(outer.size(), 3);
    for (std::size_t i = 0; i < outer.size(); ++i)
        for (int c = 0; c < 3; ++c) F(i, c) = tets.T(outer[i] / 4, corners[outer[i] % 4][c]);
    return F;
}

}  // namespace nbd

#include "tests/support/box_mesh.hpp"

#include <cmath>
#include <utility>

namespace nbd::test {

TetMesh box_mesh(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, double jitter) {
    const auto node = [&](int i, int j, int k) { return (i * (cells[1] + 1) + j) * (cells[2] + 1) + k; };
    TetMesh mesh;
    mesh.X.resize(node(cells[0], cells[1], cells[2]) + 1, 3);
    for (int i = 0; i <= cells[0]; ++i)
        for (int j = 0; j <= cells[1]; ++j)
            for (int k = 0; k <= cells[2]; ++k) {
                const Eigen::Vector3d grid(i, j, k);
                Eigen::Vector3d moved = grid;
                const bool inside = i > 0 && j > 0 && k > 0 && i < cells[0] && j < cells[1] && k < cells[2];
                for (int c = 0; inside && c < 3; ++c)
                    moved[c] += jitter * std::sin(12.9898 * i + 78.233 * j + 37.719 * k + 4.7 * c);
                mesh.X.row(node(i, j, k)) =
                    moved.cwiseQuotient(cells.cast<double>()).cwiseProduct(size).transpose();
            }
    const int paths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    mesh.T.resize(6 * cells.prod(), 4);
    int t = 0;
    for (int i = 0; i < cells[0]; ++i)
        for (int j = 0; j < cells[1]; ++j)
            for (int k = 0; k < cells[2]; ++k)
                for (int p = 0; p < 6; ++p, ++t) {
                    Eigen::Vector3i corner(i, j, k);
                    mesh.T(t, 0) = node(i, j, k);
                    for (int s = 0; s < 3; ++s) {
                        ++corner[paths[p][s]];
                        mesh.T(t, s + 1) = node(corner[0], corner[1], corner[2]);
                    }
                    const bool odd = p == 1 || p == 2 || p == 5;
                    if (odd) std::swap(mesh.T(t, 2), mesh.T(t, 3));
                }
    return mesh;
}

std::vector<int> nodes_where(const Nodes& X, const std::function<bool(const Eigen::Vector3d&)>& test) {
    std::vector<int> found;
    for (Eigen::Index i = 0; i < X.rows(); ++i)
        if (test(Eigen::Vector3d(X.row(i)))) found.push_back(i);
    return found;
}

Nodes wild_field(const Nodes& X, double size) {
    Nodes field(X.rows(), 3);
    for (Eigen::Index i = 0; i < X.rows(); ++i)
        for (int c = 0; c < 3; ++c)
            field(i, c) = size * (std::sin(5 * X(i, (c + 1) % 3) + c) +
                                  std::cos(7 * X(i, (c + 2) % 3) - 2 * c) + std::sin(11 * X(i, c) + 0.5));
    return field;
}

Eigen::RowVector3d centre(const TetMesh& tets, int tet) {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (int a = 0; a < 4; ++a) sum += 0.25 * tets.X.row(tets.T(tet, a));
    return sum;
}

}  // namespace nbd::test

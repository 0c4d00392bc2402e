#include "apps/drawing/ball_mesh.hpp"

#include <cmath>
#include <numbers>

namespace nbd {

TriMesh ball_mesh(const Eigen::Vector3d& centre, double radius, int rows) {
    const int columns = 2 * rows;
    TriMesh mesh{Nodes((rows + 1) * columns, 3), Faces(2 * rows * columns, 3)};
    for (int i = 0; i <= rows; ++i)
        for (int j = 0; j < columns; ++j) {
            const double u = std::numbers::pi * i / rows, v = 2 * std::numbers::pi * j / columns;
            const Eigen::Vector3d direction(std::sin(u) * std::cos(v), std::sin(u) * std::sin(v),
                                            std::cos(u));
            mesh.X.row(i * columns + j) = centre + radius * direction;
            if (i == rows) continue;
            const int a = i * columns + j, b = a + columns, next = (j + 1) % columns - j;
            mesh.F.row(2 * a) << a, b, b + next;
            mesh.F.row(2 * a + 1) << a, b + next, a + next;
        }
    return mesh;
}

}  // namespace nbd

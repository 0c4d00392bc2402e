#include "sim/obstacles/made_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace nbd {
namespace {

/// The surface that a line of radii and heights from the lower to the upper end of the axis sweeps about z.
/// Both ends are on the axis, no other point is.
TriMesh revolved(const std::vector<std::array<double, 2>>& line, int segments) {
    const int rings = static_cast<int>(line.size()) - 2, top = rings * segments + 1;
    TriMesh mesh{Nodes(top + 1, 3), Faces(2 * rings * segments, 3)};
    mesh.X.row(0) << 0, 0, line.front()[1];
    mesh.X.row(top) << 0, 0, line.back()[1];
    const auto vertex = [&](int ring, int side) { return 1 + ring * segments + side % segments; };
    int face = 0;
    for (int side = 0; side < segments; ++side) {
        const double angle = 2 * std::numbers::pi * side / segments;
        for (int ring = 0; ring < rings; ++ring) {
            const auto [radius, z] = line[ring + 1];
            mesh.X.row(vertex(ring, side)) << radius * std::cos(angle), radius * std::sin(angle), z;
        }
        mesh.F.row(face++) << 0, vertex(0, side + 1), vertex(0, side);
        for (int ring = 0; ring + 1 < rings; ++ring) {
            const int a = vertex(ring, side), b = vertex(ring, side + 1), c = vertex(ring + 1, side + 1),
                      d = vertex(ring + 1, side);
            mesh.F.row(face++) << a, b, c;
            mesh.F.row(face++) << a, c, d;
        }
        mesh.F.row(face++) << top, vertex(rings - 1, side), vertex(rings - 1, side + 1);
    }
    return mesh;
}

}  // namespace

TriMesh box_mesh(const Eigen::Vector3d& size) {
    TriMesh mesh{Nodes(8, 3), Faces(12, 3)};
    for (int corner = 0; corner < 8; ++corner)
        for (int axis = 0; axis < 3; ++axis)
            mesh.X(corner, axis) = ((corner >> axis & 1) != 0 ? 0.5 : -0.5) * size[axis];
    mesh.F << 0, 2, 3, 0, 3, 1,  //
        4, 5, 7, 4, 7, 6,        //
        0, 1, 5, 0, 5, 4,        //
        2, 6, 7, 2, 7, 3,        //
        0, 4, 6, 0, 6, 2,        //
        1, 3, 7, 1, 7, 5;
    return mesh;
}

TriMesh cylinder_mesh(double radius, double length, int segments) {
    const double end = length / 2;
    return revolved({{0, -end}, {radius, -end}, {radius, end}, {0, end}}, segments);
}

TriMesh capsule_mesh(double radius, double length, int segments) {
    const int rings = std::max(segments / 4, 1);  // from a pole to the widest ring
    std::vector<std::array<double, 2>> line{{0, -length / 2 - radius}};
    for (const double side : {-1.0, 1.0})
        for (int k = 1; k <= rings; ++k) {
            const int step = side < 0 ? k : rings - k + 1;
            if (side > 0 && k == 1 && length == 0) continue;  // the widest ring is there
            const double angle = std::numbers::pi / 2 * step / rings;
            line.push_back({radius * std::sin(angle), side * (length / 2 + radius * std::cos(angle))});
        }
    line.push_back({0, length / 2 + radius});
    return revolved(line, segments);
}

TriMesh height_mesh(const Eigen::MatrixXd& heights, const Eigen::Vector2d& spacing) {
    const int rows = heights.rows(), columns = heights.cols();
    TriMesh mesh{Nodes(rows * columns, 3), Faces(2 * (rows - 1) * (columns - 1), 3)};
    int face = 0;
    for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) {
            const int a = i * columns + j;
            mesh.X.row(a) << j * spacing.x(), i * spacing.y(), heights(i, j);
            if (i + 1 == rows || j + 1 == columns) continue;
            mesh.F.row(face++) << a, a + 1, a + columns + 1;
            mesh.F.row(face++) << a, a + columns + 1, a + columns;
        }
    return mesh;
}

}  // namespace nbd

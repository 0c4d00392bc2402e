#include "tests/meshing/shapes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace nbd::test {

TriMesh as_from_file(TriMesh mesh) {
    mesh.X = mesh.X.cast<float>().cast<double>().eval();
    return mesh;
}

TriMesh joined(const TriMesh& a, const TriMesh& b) {
    TriMesh both{Nodes(a.X.rows() + b.X.rows(), 3), Faces(a.F.rows() + b.F.rows(), 3)};
    both.X << a.X, b.X;
    both.F << a.F, (b.F.array() + int(a.X.rows())).matrix();
    return both;
}

TriMesh moved(TriMesh mesh, double x, double y, double z, double scale) {
    mesh.X = (mesh.X * scale).rowwise() + Eigen::RowVector3d(x, y, z);
    return mesh;
}

TriMesh tetrahedron() {
    TriMesh mesh{Nodes(4, 3), Faces(4, 3)};
    mesh.X << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
    mesh.F << 0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2;
    return mesh;
}

TriMesh icosphere(int level) {
    const double g = std::numbers::phi;
    TriMesh mesh{Nodes(12, 3), Faces(20, 3)};
    mesh.X << -1, g, 0, 1, g, 0, -1, -g, 0, 1, -g, 0, 0, -1, g, 0, 1, g, 0, -1, -g, 0, 1, -g, g, 0, -1, g, 0,
        1, -g, 0, -1, -g, 0, 1;
    mesh.F << 0, 11, 5, 0, 5, 1, 0, 1, 7, 0, 7, 10, 0, 10, 11, 1, 5, 9, 5, 11, 4, 11, 10, 2, 10, 7, 6, 7, 1,
        8, 3, 9, 4, 3, 4, 2, 3, 2, 6, 3, 6, 8, 3, 8, 9, 4, 9, 5, 2, 4, 11, 6, 2, 10, 8, 6, 7, 9, 8, 1;
    for (; level > 0; --level) {
        std::map<std::pair<int, int>, int> middle;
        Faces F(mesh.F.rows() * 4, 3);
        const auto split = [&](int a, int b) {
            const auto [found, is_new] = middle.try_emplace(std::minmax(a, b), mesh.X.rows());
            if (is_new) {
                mesh.X.conservativeResize(mesh.X.rows() + 1, 3);
                mesh.X.bottomRows(1) = (mesh.X.row(a) + mesh.X.row(b)) / 2;
            }
            return found->second;
        };
        for (int f = 0; f < mesh.F.rows(); ++f) {
            const int a = mesh.F(f, 0), b = mesh.F(f, 1), c = mesh.F(f, 2), ab = split(a, b),
                      bc = split(b, c), ca = split(c, a);
            F.middleRows(4 * f, 4) << a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca;
        }
        mesh.F = F;
    }
    mesh.X.rowwise().normalize();
    return mesh;
}

TriMesh torus(double R, double r, int nu, int nv) {
    TriMesh mesh{Nodes(nu * nv, 3), Faces(2 * nu * nv, 3)};
    for (int i = 0; i < nu; ++i)
        for (int j = 0; j < nv; ++j) {
            const double u = 2 * std::numbers::pi * i / nu, v = 2 * std::numbers::pi * j / nv;
            const double ring = R + r * std::cos(v);
            mesh.X.row(i * nv + j) << ring * std::cos(u), ring * std::sin(u), r * std::sin(v);
            const int a = i * nv + j, b = (i + 1) % nu * nv + j, c = (i + 1) % nu * nv + (j + 1) % nv,
                      d = i * nv + (j + 1) % nv;
            mesh.F.middleRows(2 * (i * nv + j), 2) << a, b, c, a, c, d;
        }
    return mesh;
}

TriMesh box(double x, double y, double z, int n) {
    std::map<std::array<int, 3>, int> number;
    std::vector<std::array<int, 3>> faces, places;
    const auto corner = [&](int i, int j, int k) {
        const auto [found, is_new] = number.try_emplace({i, j, k}, places.size());
        if (is_new) places.push_back({i, j, k});
        return found->second;
    };
    const auto square = [&](int a, int b, int c, int d) {
        faces.push_back({a, b, c});
        faces.push_back({a, c, d});
    };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const int p = i + 1, q = j + 1;
            square(corner(i, j, 0), corner(i, q, 0), corner(p, q, 0), corner(p, j, 0));
            square(corner(i, j, n), corner(p, j, n), corner(p, q, n), corner(i, q, n));
            square(corner(0, i, j), corner(0, i, q), corner(0, p, q), corner(0, p, j));
            square(corner(n, i, j), corner(n, p, j), corner(n, p, q), corner(n, i, q));
            square(corner(i, 0, j), corner(p, 0, j), corner(p, 0, q), corner(i, 0, q));
            square(corner(i, n, j), corner(i, n, q), corner(p, n, q), corner(p, n, j));
        }
    TriMesh mesh{Nodes(places.size(), 3), Faces(faces.size(), 3)};
    for (std::size_t v = 0; v < places.size(); ++v)
        mesh.X.row(v) << x * places[v][0] / n, y * places[v][1] / n, z * places[v][2] / n;
    for (std::size_t f = 0; f < faces.size(); ++f) mesh.F.row(f) << faces[f][0], faces[f][1], faces[f][2];
    return mesh;
}

std::vector<std::array<int, 3>> sorted_faces(const Faces& F) {
    std::vector<std::array<int, 3>> sorted;
    for (int f = 0; f < F.rows(); ++f) {
        std::array<int, 3> face = {F(f, 0), F(f, 1), F(f, 2)};
        std::rotate(face.begin(), std::ranges::min_element(face), face.end());
        sorted.push_back(face);
    }
    std::ranges::sort(sorted);
    return sorted;
}

}  // namespace nbd::test

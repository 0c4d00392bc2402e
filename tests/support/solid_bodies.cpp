#include "tests/support/solid_bodies.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "meshing/body/embed.hpp"
#include "meshing/body/make_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/shapes.hpp"

namespace nbd::test {

Vertices SolidBody::surface(const Vertices& nodes) const { return W * nodes; }

SolidBody solid_body(const Body& body) {
    return {body.tets, body.W.cast<float>(), body.surface.X.cast<float>(), body.surface.F};
}

TetMesh solid_box_mesh() { return box_mesh({3, 1, 1}, {9, 3, 3}, 0.2); }

SolidBody solid_box() { return solid_body(make_body("box", solid_box_mesh())); }

SolidBody solid_fork() {
    TetMesh mesh = box_mesh({3, 1, 1}, {9, 3, 3});
    std::vector<int> kept;
    for (int t = 0; t < mesh.T.rows(); ++t) {
        Eigen::RowVector3d centroid = Eigen::RowVector3d::Zero();
        for (const int node : mesh.T.row(t)) centroid += mesh.X.row(node) / 4;
        if (centroid[0] < 1 || centroid[2] < 1.0 / 3 || centroid[2] > 2.0 / 3) kept.push_back(t);
    }
    std::vector<int> number(static_cast<std::size_t>(mesh.X.rows()), -1), used;
    Tets T = mesh.T(kept, Eigen::all);
    for (int& node : T.reshaped()) {
        int& name = number[static_cast<std::size_t>(node)];
        if (name < 0) {
            name = static_cast<int>(used.size());
            used.push_back(node);
        }
        node = name;
    }
    return solid_body(make_body("fork", {mesh.X(used, Eigen::all), T}));
}

SolidBody solid_pair() {
    const TetMesh one = box_mesh({1, 1, 1}, {2, 2, 2});
    const auto nodes = one.X.rows();
    TetMesh two{Nodes(2 * nodes, 3), Tets(2 * one.T.rows(), 4)};
    two.X << one.X, one.X.rowwise() + Eigen::RowVector3d(1.5, 0, 0);
    two.T << one.T, one.T.array() + static_cast<int>(nodes);
    const Faces F = boundary_faces(two);
    SurfaceWeights W(two.X.rows(), two.X.rows());
    W.setIdentity();
    return {two, W, two.X.cast<float>(), F};
}

SolidBody solid_ball() {
    const shapes::Surface ball = shapes::sphere(14, 16, 0.58f);
    SolidBody body{box_mesh({1, 1, 1}, {3, 3, 3}, 0.2), {}, ball.X, ball.F};
    const Nodes points = (ball.X.rowwise() + Eigen::RowVector3f::Constant(0.5f)).cast<double>();
    body.W = embed(body.solid, points, {.max_distance = 2}).cast<float>();
    body.X = points.cast<float>();
    return body;
}

std::vector<SolidBody> solid_bodies() {
    return {solid_box(), solid_fork(), solid_ball(), solid_body(make_body("finer", solid_box_mesh(), {}, 1)),
            solid_body(make_body("smooth", solid_box_mesh(), {}, 1, SubdivisionScheme::loop))};
}

Vertices solid_pose(const SolidBody& body, int number) {
    std::mt19937 random(static_cast<unsigned>(number) + 1);
    const auto draw = [&] { return static_cast<double>(shapes::uniform(random)); };
    Nodes x = body.solid.X;
    const auto all = [&](const auto& f) {
        for (Eigen::Index i = 0; i < x.rows(); ++i) x.row(i) = f(Eigen::Vector3d(x.row(i))).transpose();
    };
    const auto noise = [&](double size) {
        for (double& coordinate : x.reshaped()) coordinate += size * draw();
    };
    const double bend = 2.5 * draw(), twist = 2 * draw();
    switch (number % pose_kinds) {
        case 0:  // rigid, below
            break;
        case 1:  // bent and twisted
            all([&](const Eigen::Vector3d& p) {
                const double s = p[0] - 1.5, a = bend * s;
                const Eigen::Vector3d turned =
                    Eigen::AngleAxisd(twist * s, Eigen::Vector3d::UnitX()) * Eigen::Vector3d(0, p[1], p[2]);
                return Eigen::Vector3d(s * std::cos(a) - turned[2] * std::sin(a), turned[1],
                                       s * std::sin(a) + turned[2] * std::cos(a));
            });
            break;
        case 2:
            x += wild_field(x, 0.1 * draw());
            break;
        case 3:
            x += wild_field(x, 2 * draw());
            break;
        case 4:  // tetrahedra inverted at random
            noise(1);
            break;
        case 5:  // crushed flat
            x.col(number % 3) *= 1e-5 * draw();
            break;
        case 6:  // stretched to a needle
            x.col(number % 3) *= 200 * draw();
            break;
        case 7:  // one node far away
            x.row(static_cast<int>(random() % static_cast<unsigned>(x.rows()))).setConstant(30 * draw());
            break;
        case 8:  // collapsed into one point, up to rounding
            x *= 1e-7 * draw();
            break;
        default:  // tiny or huge
            x *= std::pow(10, 6 * draw());
            noise(0.1 * x.norm() / static_cast<double>(x.rows()));
    }
    const double far = number % 3 == 0 ? 0 : std::pow(10, 2.5 + 2.5 * draw());
    const Eigen::Quaterniond turn = Eigen::Quaterniond(draw(), draw(), draw(), draw()).normalized();
    const Eigen::RowVector3d shift = far * Eigen::RowVector3d(draw(), draw(), draw());
    return ((x * turn.toRotationMatrix().transpose()).rowwise() + shift).cast<float>();
}

}  // namespace nbd::test

#include "tests/training/bar.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "collision/base/counter_random.hpp"

namespace nbd::test {
namespace {

/// Closed grid on the box, 4 cells x cells x cells.
void surface_grid(int cells, Vertices& X, Faces& F) {
    const std::array<int, 3> count{4 * cells, cells, cells};
    std::map<std::array<int, 3>, int> number;
    std::vector<std::array<int, 3>> points;
    std::vector<std::array<int, 3>> faces;
    const auto vertex = [&](const std::array<int, 3>& p) {
        const auto [at, fresh] = number.try_emplace(p, points.size());
        if (fresh) points.push_back(p);
        return at->second;
    };
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
            const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
            for (int i = 0; i < count[u]; ++i)
                for (int j = 0; j < count[v]; ++j) {
                    std::array<int, 4> quad{};
                    for (int corner = 0; corner < 4; ++corner) {
                        std::array<int, 3> p{};
                        p[axis] = side * count[axis];
                        p[u] = i + (corner == 1 || corner == 2);
                        p[v] = j + (corner >= 2);
                        quad[corner] = vertex(p);
                    }
                    if (side == 0) std::swap(quad[1], quad[3]);
                    faces.push_back({quad[0], quad[1], quad[2]});
                    faces.push_back({quad[0], quad[2], quad[3]});
                }
        }
    X.resize(points.size(), 3);
    for (Eigen::Index i = 0; i < X.rows(); ++i)
        for (int a = 0; a < 3; ++a) {
            const std::size_t axis = a;
            const float s = static_cast<float>(points[i][axis]) / static_cast<float>(count[axis]);
            X(i, a) = a == 0 ? 4 * s : s - 0.5f;
        }
    F.resize(faces.size(), 3);
    for (Eigen::Index i = 0; i < F.rows(); ++i)
        for (int a = 0; a < 3; ++a) F(i, a) = faces[i][a];
}

/// Trilinear weights in the lattice cell that contains the vertex.
SurfaceEmbedding embedding(const Vertices& X) {
    std::vector<Eigen::Triplet<float>> entries;
    for (int v = 0; v < X.rows(); ++v) {
        const float s = X(v, 0) / 4 * (Bar::columns - 1);
        const int column = std::min(static_cast<int>(s), Bar::columns - 2);
        for (int corner = 0; corner < 8; ++corner) {
            const float along = s - static_cast<float>(column);
            const float w = (corner & 4 ? along : 1 - along) *
                            (corner & 2 ? X(v, 1) + 0.5f : 0.5f - X(v, 1)) *
                            (corner & 1 ? X(v, 2) + 0.5f : 0.5f - X(v, 2));
            if (w > 0) entries.emplace_back(v, 4 * column + corner, w);
        }
    }
    SurfaceEmbedding W(X.rows(), Bar::nodes);
    W.setFromTriplets(entries.begin(), entries.end());
    return W;
}

/// Smooth orthonormal fields of the nodes, free of rigid motion, smoothest first. rest: [nodes, 3].
Eigen::MatrixXf smooth_fields(const Vertices& rest, int count) {
    constexpr int nodes = Bar::nodes;
    Eigen::MatrixXd fields(3 * nodes, 6 + count);
    fields.setZero();
    for (int i = 0; i < nodes; ++i) {
        const Eigen::Vector3d X = rest.row(i).cast<double>().transpose() - Eigen::Vector3d(2, 0, 0);
        for (int axis = 0; axis < 3; ++axis) {
            fields(3 * i + axis, axis) = 1;
            fields.block<3, 1>(3 * i, 3 + axis) = Eigen::Vector3d::Unit(axis).cross(X);
        }
        for (int j = 0; j < count; ++j) {
            const double wave = std::cos(M_PI * (j / 9 + 1) * rest(i, 0) / 4);
            const double across = j / 3 % 3 == 0 ? 1 : X[j / 3 % 3];
            fields(3 * i + j % 3, 6 + j) = wave * across;
        }
    }
    const Eigen::MatrixXd Q = Eigen::HouseholderQR<Eigen::MatrixXd>(fields).householderQ() *
                              Eigen::MatrixXd::Identity(3 * nodes, 6 + count);
    return Q.rightCols(count).cast<float>();
}

}  // namespace

Bar::Bar(int modes, int cells) {
    rest.resize(nodes, 3);
    for (int i = 0; i < nodes; ++i)
        rest.row(i) << 4.f * static_cast<float>(i / 4) / (columns - 1), static_cast<float>(i / 2 % 2) - 0.5f,
            static_cast<float>(i % 2) - 0.5f;
    Vertices X;
    Faces F;
    surface_grid(cells, X, F);
    const SurfaceEmbedding W = embedding(X);
    body = make_surface_body(X, F, W, smooth_fields(rest, modes), std::string(64, 'b'));
}

Vertices Bar::pose(double bend, double twist, double stretch, const Eigen::Quaterniond& turn,
                   const Eigen::Vector3d& move) const {
    Vertices x(nodes, 3);
    for (int i = 0; i < nodes; ++i) {
        const double s = rest(i, 0) / 4.0 - 0.5, c = std::cos(twist * s), d = std::sin(twist * s);
        const double y = rest(i, 1), z = rest(i, 2), length = 4 * (1 + stretch);
        const double yt = c * y - d * z, zt = d * y + c * z, a = bend * s;
        const double arc = std::abs(bend) < 1e-9 ? length * s : length * std::sin(a) / bend;
        const double sag = std::abs(bend) < 1e-9 ? 0 : length * (1 - std::cos(a)) / bend;
        const Eigen::Vector3d p(arc - zt * std::sin(a), yt, sag + zt * std::cos(a));
        x.row(i) = (turn * p + move).cast<float>().transpose();
    }
    return x;
}

Vertices Bar::frame(std::uint64_t seed, int trajectory, int frame) const {
    const auto draw = [&](std::uint64_t i) { return 2 * counter_uniform(seed, trajectory, i) - 1; };
    const double t = 0.15 * frame;
    const Eigen::Quaterniond turn = Eigen::Quaterniond(draw(0), draw(1), draw(2), draw(3)).normalized() *
                                    Eigen::Quaterniond(Eigen::AngleAxisd(t, Eigen::Vector3d::UnitY()));
    return pose(1.5 * draw(4) * std::sin(t + draw(5)), draw(6) * std::sin(1.7 * t),
                0.2 * draw(7) * std::sin(2.3 * t), turn, {t, -t, 3 * draw(8)});
}

void Bar::record(const std::filesystem::path& path, int trajectories, int frames, std::uint64_t seed,
                 const std::vector<int>& failed) const {
    RecordingWriter file(path);
    for (int id = 0; id < trajectories; ++id) {
        TrajectoryInfo info;
        info.id = id;
        info.seed = seed;
        info.body_hash = body.hash;
        info.recipe = "{}";
        const int handle = file.begin_trajectory(info, nodes);
        for (int f = 0; f < frames; ++f) file.add_frame(handle, 0.01 * f, frame(seed, id, f));
        const bool fails = std::find(failed.begin(), failed.end(), id) != failed.end();
        file.end_trajectory(handle, fails ? "tetrahedron 3 inverted" : "");
    }
    file.finish();
}

RecordingReader Bar::recorded(const std::filesystem::path& path, const std::vector<Vertices>& poses) const {
    RecordingWriter file(path);
    const int handle = file.begin_trajectory({.body_hash = body.hash, .recipe = {}, .failure = {}}, nodes);
    for (int time = 0; const Vertices& x : poses) file.add_frame(handle, time++, x);
    file.end_trajectory(handle);
    file.finish();
    return RecordingReader(path);
}

}  // namespace nbd::test

#include "apps/bench/exactness/wild_poses.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nbd {
namespace {

using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// Positions about the middle of their box; the half diagonal becomes 1.
Points normalised(const Vertices& nodes) {
    const Points x = nodes.cast<double>();
    const Eigen::RowVector3d lo = x.colwise().minCoeff(), hi = x.colwise().maxCoeff();
    return (x.rowwise() - (lo + hi) / 2) / ((hi - lo).norm() / 2);
}

void twist(Points& x, CounterRandom& random) {
    const double turns = random.uniform(0.3, 3);
    for (auto p : x.rowwise()) {
        const double angle = std::numbers::pi * turns * p[2], c = std::cos(angle), s = std::sin(angle);
        p = Eigen::RowVector3d(c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]);
    }
}

void crush(Points& x, CounterRandom& random) {
    x.col(random.index(3)) *= std::pow(10, random.uniform(-5, -1));
}

void fold(Points& x, CounterRandom& random) {
    const int axis = random.index(3);
    const double plane = random.uniform(-0.3, 0.3) * x.col(axis).cwiseAbs().maxCoeff();
    x.col(axis) = plane - (x.col(axis).array() - plane).abs();
}

void scatter(Points& x, CounterRandom& random) {
    const double by = random.uniform(0.01, 0.1);
    for (auto p : x.rowwise()) p += by * random.unit() * random.direction().transpose();
}

void deform(Points& x, WildPose pose, CounterRandom& random) {
    x *= random.orientation().toRotationMatrix();
    switch (pose) {
        case WildPose::twisted:
            return twist(x, random);
        case WildPose::crushed:
            return crush(x, random);
        case WildPose::inverted:
            return fold(x, random);
        case WildPose::scattered:
            return scatter(x, random);
        case WildPose::far:
            return;
    }
}

}  // namespace

const char* name(WildPose pose) noexcept {
    constexpr const char* names[] = {"twisted", "crushed", "inverted", "scattered", "far"};
    return names[static_cast<int>(pose)];
}

WildScene draw_wild_scene(const Vertices& nodes, WildPose pose, double overlap, CounterRandom random) {
    Points a = normalised(nodes), b = a;
    for (Points* x : {&a, &b}) {
        deform(*x, pose, random);
        *x *= random.orientation().toRotationMatrix();
    }
    const auto middle = [](const Points& x) {
        return Eigen::RowVector3d((x.colwise().minCoeff() + x.colwise().maxCoeff()) / 2);
    };
    const auto half = [](const Points& x) {
        return Eigen::RowVector3d((x.colwise().maxCoeff() - x.colwise().minCoeff()) / 2);
    };
    const Eigen::RowVector3d towards = random.direction().transpose();
    const Eigen::RowVector3d apart =
        (half(a) + half(b)).cwiseProduct(towards) * ((1 - overlap) / towards.cwiseAbs().maxCoeff());
    b.rowwise() += middle(a) + apart - middle(b);
    if (pose == WildPose::far) {
        const Eigen::RowVector3d away = std::pow(10, random.uniform(3, 5)) * random.direction().transpose();
        a.rowwise() += away;
        b.rowwise() += away;
    }
    return {a.cast<float>(), b.cast<float>()};
}

}  // namespace nbd

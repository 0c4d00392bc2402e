// 03: How far apart are two bodies, and where do they come closest?
//
//     build/release/apps/examples/03_closest_points
//
// ClosestQuery searches the trees of two posed bodies, the most promising parts first. nbd::closest_points()
// asks the same of plain arrays, once.

#include <cmath>
#include <cstdio>
#include <optional>

#include "apps/examples/ball.hpp"
#include "collision/query/closest_query.hpp"

int main() {
    const Surface s = ball(1);
    const auto tree = nbd::shared_exact_tree(s.x, s.F);  // both bodies are copies of one ball
    nbd::PosedTree a(tree, nbd::BoundKind::boxes), b(tree, nbd::BoundKind::boxes);
    nbd::ClosestQuery query;

    a.begin_pose(s.x);
    nbd::Vertices x = s.x;
    bool right = true;
    for (const float centre : {5.f, 3.f, 2.5f, 1.5f}) {
        x = s.x.rowwise() + centre * Eigen::RowVector3f(0.6f, 0.8f, 0);
        b.begin_pose(x);
        const std::optional<nbd::ClosestFaces> closest = query.closest(a, b);
        if (!closest) return 1;  // happens only before the first pose, or with a limit as below
        const Eigen::Vector3d& p = closest->points.a;
        std::printf(
            "centres %.1f m apart: faces %4d and %4d, %.4f m, from (%5.2f %5.2f %5.2f); "
            "%ld face pairs measured\n",
            centre, closest->faces.a, closest->faces.b, closest->points.distance, p.x(), p.y(), p.z(),
            query.triangle_tests());
        // The faces lie inside the ideal balls, by less than 2 cm each.
        const double ideal = std::fmax(centre - 2., 0.);
        right &= closest->points.distance >= ideal - 1e-6 && closest->points.distance < ideal + 0.04;
    }

    // With a limit the search may stop early: it says whether anything is that close.
    x = s.x.rowwise() + Eigen::RowVector3f(3, 0, 0);
    b.begin_pose(x);
    const bool within_half = query.closest(a, b, 0.5).has_value();
    const bool within_two = query.closest(a, b, 2).has_value();
    std::printf("centres 3.0 m apart: closer than 0.5 m: %s, closer than 2 m: %s\n",
                within_half ? "yes" : "no", within_two ? "yes" : "no");
    return right && !within_half && within_two ? 0 : 1;
}

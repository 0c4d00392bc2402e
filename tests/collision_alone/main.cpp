// Finds the crossing faces of two overlapping cubes, using only the public headers of nbd::collision.

#include <cstdio>

#include "collision/query/pair_query.hpp"
#include "collision/tree/collision_tree.hpp"
#include "collision/tree/posed_tree.hpp"
#include "tests/support/brute_force.hpp"

int main() {
    nbd::Vertices X(8, 3);
    X << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1;
    nbd::Faces F(12, 3);
    F << 0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3,
        4, 7;

    const auto cube = nbd::shared_exact_tree(X, F, {.depth = 2, .min_leaf_faces = 2});
    nbd::PosedTree a(cube, nbd::BoundKind::exact), b(cube, nbd::BoundKind::exact);
    const nbd::Vertices here = X;
    const nbd::Vertices there = X.rowwise() + Eigen::RowVector3f(0.7f, 0.6f, 0.55f);
    a.begin_pose(here);
    b.begin_pose(there);

    nbd::PairQuery query;
    const std::size_t expected = nbd::test::brute_force_intersecting(here, F, there, F).size();
    const std::size_t found = query.intersecting(a, b).size();
    std::printf("%zu face pairs cross, %zu expected; %ld spheres computed, %ld face pairs tested\n", found,
                expected, query.counters().nodes_bounded, query.counters().triangle_tests);
    return found == expected && expected > 0 ? 0 : 1;
}

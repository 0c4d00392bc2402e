// 02: Which faces touch, frame after frame, and how far apart are bodies that do not?
//
//     build/release/apps/examples/02_queries_frame_by_frame
//
// A moving body has one tree, built once, and a PosedTree that gets every new pose. Keep the PairQuery too:
// it owns the scratch memory, so that queries allocate nothing after a warm-up. This program counts the calls
// of operator new to show it. ClosestQuery searches the same trees, the most promising parts first.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <optional>

#include "apps/examples/ball.hpp"
#include "collision/query/closest_query.hpp"
#include "collision/query/one_shot.hpp"
#include "collision/query/pair_query.hpp"

static long allocations = 0;
void* operator new(std::size_t size) {
    ++allocations;
    if (void* memory = std::malloc(size)) return memory;
    throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

// Stands in for a simulator: b swings past a and wobbles. Writes into x, which keeps its place in memory.
static void simulate(const nbd::Vertices& rest, int frame, nbd::Vertices& x) {
    const float t = 0.1f * static_cast<float>(frame);
    for (Eigen::Index v = 0; v < rest.rows(); ++v) {
        const float swell = 1 + 0.1f * std::sin(5 * rest(v, 2) + 3 * t);
        x.row(v) = swell * rest.row(v) + Eigen::RowVector3f(2.6f - t, 0.8f * std::sin(t), 0.3f);
    }
}

int main() {
    const Surface a = ball(1), b = ball(0.8f);

    // A tree is the same for all copies of a body, so it is shared.
    nbd::PosedTree tree_a(nbd::shared_exact_tree(a.x, a.F), nbd::BoundKind::boxes);
    nbd::PosedTree tree_b(nbd::shared_exact_tree(b.x, b.F), nbd::BoundKind::boxes);
    nbd::PairQuery query;
    nbd::ClosestQuery distances;

    // begin_pose() refers to the positions and does not copy them: they must outlive the queries.
    nbd::Vertices x = b.x;
    tree_a.begin_pose(a.x);
    bool right = true;
    long touching = 0, when_warm = 0;
    for (int round = 0; round < 2; ++round)  // the first round is the warm-up
        for (int frame = 0; frame < 30; ++frame) {
            simulate(b.x, frame, x);
            const long before = allocations;
            tree_b.begin_pose(x);
            const auto pairs = query.intersecting(tree_a, tree_b);  // valid until the next query
            if (round == 0) {
                right &= pairs.size() == nbd::intersecting_faces(a.x, a.F, x, b.F).size();
                touching += pairs.size();
                // With a limit the search may stop early: it says whether anything is that close.
                const std::optional<nbd::ClosestFaces> near = distances.closest(tree_a, tree_b, 0.3);
                right &= pairs.empty() || (near && near->points.distance == 0);
                if (frame % 6 != 0) continue;
                if (near)
                    std::printf("frame %2d: %3zu face pairs touch; faces %4d and %4d are %.4f m apart\n",
                                frame, pairs.size(), near->faces.a, near->faces.b, near->points.distance);
                else
                    std::printf("frame %2d: more than 30 cm apart\n", frame);
            } else {
                when_warm += allocations - before;
            }
        }
    std::printf("%ld face pairs in all; %ld allocations in 30 warm frames\n", touching, when_warm);
    return right && touching > 100 && when_warm == 0 ? 0 : 1;
}

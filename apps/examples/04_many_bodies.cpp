// 04: Which of many bodies touch, and where?
//
//     build/release/apps/examples/04_many_bodies
//
// ManyBodyQuery sweeps over the bodies' boxes and asks a PairQuery for each pair of bodies whose boxes
// overlap. With an executor, it tests pairs in parallel, with the same answer.

#include <algorithm>
#include <cstdio>
#include <functional>
#include <thread>
#include <vector>

#include "apps/examples/ball.hpp"
#include "collision/query/many_body_query.hpp"

// An executor on two threads. With TBB: tbb::parallel_for(0, count, task).
static void on_two_threads(int count, const std::function<void(int)>& task) {
    std::thread odd([&] {
        for (int i = 1; i < count; i += 2) task(i);
    });
    for (int i = 0; i < count; i += 2) task(i);
    odd.join();
}

int main() {
    // 27 balls of 0.5 m on a grid: 0.97 m from one to the next along x, so that neighbours overlap, and 1.1 m
    // along y and z, where they do not.
    const Surface s = ball(0.5f);
    const auto tree = nbd::shared_exact_tree(s.x, s.F);
    std::vector<nbd::Vertices> poses;
    for (int i = 0; i < 27; ++i) {
        const Eigen::RowVector3f place(static_cast<float>(i % 3), static_cast<float>(i / 3 % 3),
                                       static_cast<float>(i / 9));
        poses.push_back(s.x.rowwise() + place.cwiseProduct(Eigen::RowVector3f(0.97f, 1.1f, 1.1f)));
    }

    // Each body has its own PosedTree. All share the tree of the ball at rest.
    std::vector<nbd::PosedTree> trees;
    std::vector<nbd::PosedTree*> bodies;
    trees.reserve(poses.size());
    for (const nbd::Vertices& x : poses) {
        trees.emplace_back(tree, nbd::BoundKind::boxes).begin_pose(x);
        bodies.push_back(&trees.back());
    }

    nbd::ManyBodyQuery in_order, threaded(on_two_threads);
    const auto touching = in_order.intersecting(bodies);
    std::printf("%zu of %zu bodies' pairs touch; %d pairs were asked, in %d rounds\n", touching.size(),
                bodies.size() * (bodies.size() - 1) / 2, in_order.pairs_asked(), in_order.rounds());
    for (const nbd::TouchingBodies& pair : touching.first(std::min<std::size_t>(touching.size(), 3)))
        std::printf("bodies %d and %d: %zu face pairs\n", pair.bodies.a, pair.bodies.b, pair.faces.size());

    const bool same =
        std::ranges::equal(touching, threaded.intersecting(bodies), [](const auto& p, const auto& q) {
            return p.bodies == q.bodies && std::ranges::equal(p.faces, q.faces);
        });
    std::printf("two threads give %s answer\n", same ? "the same" : "ANOTHER");
    return touching.size() == 18 && same ? 0 : 1;  // two neighbours in each of nine rows
}

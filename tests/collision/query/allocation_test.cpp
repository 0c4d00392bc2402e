// A separate program because it counts every allocation of the process.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <memory>

#include "collision/query/closest_query.hpp"
#include "collision/query/many_body_query.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"
#include "tests/collision/bounds/affine/hung_surface.hpp"
#include "tests/collision/models.hpp"

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
}

namespace {
std::atomic<long> allocations{0};
}

// Counts malloc too, because Eigen's arrays bypass operator new.
extern "C" {
void* malloc(std::size_t size) {
    ++allocations;
    return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
    ++allocations;
    return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
    ++allocations;
    return __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    ++allocations;
    return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
    ++allocations;
    *out = __libc_memalign(alignment, size);
    return *out == nullptr;
}
}

namespace nbd {
namespace {

TEST(AllocationCount, CountsAllocationsOfVectorsAndMatrices) {
    long before = allocations;
    const std::vector<int> numbers(100);
    EXPECT_GT(allocations, before);
    before = allocations;
    const Eigen::VectorXf vector = Eigen::VectorXf::Zero(100);
    EXPECT_GT(allocations, before);
}

/// Expects that queries between two trees allocate nothing once all poses were seen. begin: starts a pose of
/// a tree. step: starts a step of one.
template <class Begin, class Step>
void expect_no_allocations(PosedTree& a, PosedTree& b, const Vertices& rest, const Begin& begin,
                           const Step& step) {
    PairQuery query;
    ClosestQuery closest;
    ManyBodyQuery many;
    SelfQuery self;
    PosedTree* const bodies[] = {&a, &b};
    std::mt19937 random(2);
    std::vector<Vertices> poses, moved_on;
    for (int i = 0; i < 8; ++i) {
        poses.push_back(
            shapes::moved(shapes::wobbled(rest, random, 0.05f), shapes::random_motion(random, 0.4f)));
        moved_on.push_back(poses.back().rowwise() + Eigen::RowVector3f(0.01f, 0, 0));
    }
    long pairs = 0;
    const auto run = [&] {
        for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
            begin(a, poses[i]);
            begin(b, poses[i + 1]);
            query.intersecting(a, b);
            pairs += query.counters().face_pairs;
            query.within(a, b, 0.02f);
            query.leaf_pairs(a, b, 0.02f);
            closest.closest(a, b);
            pairs += static_cast<long>(many.intersecting(bodies).size());
            self.intersecting(a);
            pairs += static_cast<long>(self.within(b, 0.01f).size());
            a.sphere(17);
            step(a, poses[i], moved_on[i]);
            step(b, poses[i + 1], moved_on[i + 1]);
            query.boxes_within(a, b, 0.02f);
            self.boxes_within(a, 0);
        }
    };
    run();
    const long before = allocations;
    run();
    EXPECT_EQ(allocations - before, 0) << name(a.kind());
    EXPECT_GT(pairs, 100) << name(a.kind());
}

TEST(WarmQueries, AllocateNothing) {
    const auto s = shapes::torus(40, 24);
    const auto tree =
        std::make_shared<const CollisionTree>(shapes::full_tree(s, shapes::make_modes(s, 20, 200, 1)));
    for (const BoundKind kind : bound_kinds) {
        if (!has_bounds(*tree, kind)) continue;
        PosedTree a(tree, kind), b(tree, kind, kind == BoundKind::boxes ? 0.f : 0.1f);
        expect_no_allocations(
            a, b, s.X, [](PosedTree& body, const Vertices& x) { body.begin_pose(x); },
            [](PosedTree& body, const Vertices& x, const Vertices& y) { body.begin_step(x, y); });
    }
}

TEST(WarmQueries, AllocateNothingWithNetworksInFloats) {
    const auto s = shapes::torus(40, 24);
    CollisionTree tree = shapes::full_tree(s, shapes::make_modes(s, 20, 200, 1));
    NbdNetworks& networks = tree.nbd->networks;
    networks = NbdNetworks(networks.inputs(), networks.hidden(), networks.weights(), NetworkNumbers::floats);
    const auto shared = std::make_shared<const CollisionTree>(std::move(tree));
    PosedTree a(shared, BoundKind::nbd), b(shared, BoundKind::nbd, 0.1f);
    expect_no_allocations(
        a, b, s.X, [](PosedTree& body, const Vertices& x) { body.begin_pose(x); },
        [](PosedTree& body, const Vertices& x, const Vertices& y) { body.begin_step(x, y); });
}

TEST(WarmQueries, AllocateNothingWithAffineBounds) {
    const test::HungSurface s = test::hung_on_tets(shapes::torus(60, 40), 4);
    CollisionTree tree = make_exact_tree(s.surface.X, s.surface.F);
    hang_on_nodes(tree, s.W, s.rest);
    const auto shared = std::make_shared<const CollisionTree>(std::move(tree));
    PosedTree a(shared, BoundKind::affine), b(shared, BoundKind::affine);
    expect_no_allocations(
        a, b, s.rest, [](PosedTree& body, const Vertices& x) { body.begin_pose_of_nodes(x); },
        [](PosedTree& body, const Vertices& x, const Vertices& y) { body.begin_step_of_nodes(x, y); });
}

}  // namespace
}  // namespace nbd

// A separate program because it counts every allocation of the process.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <memory>
#include <new>

#include "collision/query/closest_query.hpp"
#include "collision/query/many_body_query.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"
#include "tests/collision/models.hpp"
#include "tests/collision/wide_tree/hung_surface.hpp"

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
}

namespace {
std::atomic<long> allocations{0};
std::atomic<long> fails_at{-1};  // the allocation that finds no memory; -1: none

/// Counts an allocation; returns whether there is memory for it.
bool is_granted() { return ++allocations != fails_at; }
}  // namespace

// Counts malloc too, because Eigen's arrays bypass operator new.
extern "C" {
void* malloc(std::size_t size) { return is_granted() ? __libc_malloc(size) : nullptr; }
void* calloc(std::size_t count, std::size_t size) {
    return is_granted() ? __libc_calloc(count, size) : nullptr;
}
void* realloc(void* old, std::size_t size) { return is_granted() ? __libc_realloc(old, size) : nullptr; }
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    return is_granted() ? __libc_memalign(alignment, size) : nullptr;
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
    *out = is_granted() ? __libc_memalign(alignment, size) : nullptr;
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
            closest.closest(a, b);
            pairs += static_cast<long>(many.intersecting(bodies).size());
            self.intersecting(a);
            pairs += static_cast<long>(self.within(b, 0.01f).size());
            if (!is_box(a.kind())) a.sphere(17);
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
    const auto tree = shapes::shared_full_tree(s, 20, 200, 1);
    for (const BoundKind kind : shapes::kinds_of(*tree)) {
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
    const auto tree = test::hung_tree(s);
    PosedTree a(tree, BoundKind::affine), b(tree, BoundKind::affine);
    expect_no_allocations(
        a, b, s.rest, [](PosedTree& body, const Vertices& x) { body.begin_pose_of_nodes(x); },
        [](PosedTree& body, const Vertices& x, const Vertices& y) { body.begin_step_of_nodes(x, y); });
}

TEST(WarmQueries, AllocateNothingTheSecondTime) {
    const auto s = shapes::torus(60, 40);
    const auto tree = shapes::shared_full_tree(s, 20, 200, 1, {.depth = 2});
    const Vertices y = s.X.rowwise() + Eigen::RowVector3f(0.3f, 0.2f, 0.1f);
    for (const BoundKind kind : {BoundKind::exact, BoundKind::bd, BoundKind::nbd, BoundKind::boxes}) {
        PosedTree a(tree, kind), b(tree, kind);
        a.begin_pose(s.X);
        b.begin_pose(y);
        for (const float distance : {0.1f, 0.2f}) {
            PairQuery query;
            SelfQuery self;
            EXPECT_GT(query.within(a, b, distance).size(), 100u) << name(kind);
            EXPECT_GT(self.within(a, distance).size(), 100u) << name(kind);
            const long before = allocations;
            query.within(a, b, distance);
            EXPECT_EQ(allocations - before, 0) << name(kind) << ", two bodies within " << distance;
            self.within(a, distance);
            EXPECT_EQ(allocations - before, 0) << name(kind) << ", itself within " << distance;
        }
    }
}

/// Poses of a body that comes to overlap one in the last pose more and more.
struct GrowingContact {
    test::HungSurface hung = test::hung_on_tets(shapes::torus(40, 24), 4);
    std::shared_ptr<const CollisionTree> tree = make_tree();
    std::vector<Vertices> surfaces, nodes;

    GrowingContact() {
        for (int i = 0; i <= 10; ++i) {
            const Eigen::RowVector3f by(2.6f - 0.26f * static_cast<float>(i), 0.1f, 0.05f);
            surfaces.push_back(hung.surface.X.rowwise() + by);
            nodes.push_back(hung.rest.rowwise() + by);
        }
    }
    std::shared_ptr<const CollisionTree> make_tree() const {
        CollisionTree made = shapes::full_tree(hung.surface, shapes::make_modes(hung.surface, 20, 200, 1));
        hang_on_nodes(made, hung.W, hung.rest);
        return std::make_shared<const CollisionTree>(std::move(made));
    }
    std::vector<BoundKind> kinds() const {
        std::vector<BoundKind> result = shapes::kinds_of(*tree);
        std::erase(result, BoundKind::automatic);
        return result;
    }
    /// Starts a pose, or a step that ends in it.
    void begin(PosedTree& body, std::size_t pose, bool in_step) const {
        const std::size_t before = pose == 0 ? 0 : pose - 1;
        if (body.kind() == BoundKind::affine && in_step)
            body.begin_step_of_nodes(nodes[before], nodes[pose]);
        else if (body.kind() == BoundKind::affine)
            body.begin_pose_of_nodes(nodes[pose]);
        else if (in_step)
            body.begin_step(surfaces[before], surfaces[pose]);
        else
            body.begin_pose(surfaces[pose]);
    }
};

/// Everything that is asked of two bodies.
struct AllQueries {
    PairQuery pairs;
    ClosestQuery closest;
    SelfQuery self;
    ManyBodyQuery many;
    long found = 0;  // pairs of faces
    std::size_t most_pairs = 0, most_candidates = 0;

    void ask(PosedTree& a, PosedTree& b) {
        const auto count = [&](const QueryCounters& counters) {
            most_pairs = std::max(most_pairs, static_cast<std::size_t>(counters.most_pairs));
        };
        found = pairs.intersecting(a, b).size();
        count(pairs.counters());
        pairs.within(a, b, 0.05f);
        count(pairs.counters());
        pairs.boxes_within(a, b, 0.05f);
        count(pairs.counters());
        self.within(b, 0.01f);
        count(self.counters());
        closest.closest(a, b);
        most_candidates = std::max(most_candidates, closest.most_candidates());
        PosedTree* const bodies[] = {&a, &b};
        many.intersecting(bodies);
    }
};

TEST(GrowingContacts, AllocateNothingInReservedMemoryAndSomeWithoutIt) {
    const GrowingContact scene;
    for (const bool in_step : {false, true})
        for (const BoundKind kind : scene.kinds()) {
            PosedTree a(scene.tree, kind), b(scene.tree, kind), c(scene.tree, kind), d(scene.tree, kind);
            scene.begin(a, 10, in_step);
            scene.begin(c, 10, in_step);
            AllQueries growing, reserved;
            long first_found = 0, allocated_late = 0;
            for (std::size_t i = 0; i < 10; ++i) {
                scene.begin(b, i, in_step);
                const long before = allocations;
                growing.ask(a, b);
                if (i == 0) first_found = growing.found;
                if (i > 4) allocated_late += allocations - before;
            }
            EXPECT_GT(growing.found, first_found + 300) << name(kind);
            EXPECT_GT(allocated_late, 0) << name(kind);

            PosedTree* const bodies[] = {&c, &d};
            c.reserve();
            d.reserve();
            reserved.pairs.reserve(c, d, growing.most_pairs);
            reserved.self.reserve(d, growing.most_pairs);
            reserved.closest.reserve(growing.most_candidates);
            reserved.many.reserve(bodies, 1, growing.most_pairs);
            for (std::size_t i = 0; i < 10; ++i) {
                const long before = allocations;
                scene.begin(d, i, in_step);
                reserved.ask(c, d);
                EXPECT_EQ(allocations - before, 0) << name(kind) << ", pose " << i;
            }
            EXPECT_EQ(reserved.found, growing.found) << name(kind);
        }
}

TEST(GrowingContacts, AllocateNothingInReservedMemoryWhereSpheresMeetBoxes) {
    const GrowingContact scene;
    for (const BoundKind kind : {BoundKind::exact, BoundKind::bd, BoundKind::nbd}) {
        PosedTree a(scene.tree, kind), b(scene.tree, kind), boxes(scene.tree, BoundKind::boxes);
        PairQuery first, reserved;
        SelfQuery self;
        constexpr std::size_t pairs = 100'000;
        reserved.reserve(a, b, pairs);  // before these bodies have boxes
        self.reserve(a, pairs);
        const auto ask = [&](PairQuery& query) {
            a.begin_step(scene.surfaces[9], scene.surfaces[10]);
            b.begin_step(scene.surfaces[8], scene.surfaces[9]);
            query.boxes_within(a, b, 0.01f);
            EXPECT_GT(query.counters().face_pairs, 300) << name(kind);
            EXPECT_LT(query.counters().most_pairs, static_cast<long>(pairs)) << name(kind);
            a.begin_pose(scene.surfaces[10]);
            boxes.begin_pose(scene.surfaces[9]);
            query.intersecting(a, boxes);
            EXPECT_GT(query.counters().face_pairs, 300) << name(kind);
        };
        ask(first);
        const long before = allocations;
        ask(reserved);
        a.begin_step(scene.surfaces[9], scene.surfaces[10]);
        self.boxes_within(a, 0);
        EXPECT_EQ(allocations - before, 0) << name(kind);
    }
}

TEST(GrowingContacts, LeaveBodiesAndQueriesUsableWhereMemoryRunsOut) {
    const GrowingContact scene;
    for (const bool in_step : {false, true})
        for (const BoundKind kind : scene.kinds()) {
            if (in_step && is_box(kind)) continue;  // as in a pose, but slower
            int failed = 0;
            for (long n = 1;; ++n) {
                PosedTree a(scene.tree, kind), b(scene.tree, kind);
                AllQueries queries;
                scene.begin(a, 10, in_step);
                bool has_failed = false;
                fails_at = allocations + n;
                try {
                    scene.begin(b, 9, in_step);
                    queries.ask(a, b);
                } catch (const std::bad_alloc&) {
                    has_failed = true;
                }
                fails_at = -1;
                if (!has_failed) break;
                ++failed;
                if (n % 5 != 1) continue;  // the same objects go on, and answer as new ones do
                scene.begin(b, 9, in_step);
                queries.ask(a, b);
                PosedTree c(scene.tree, kind), d(scene.tree, kind);
                scene.begin(c, 10, in_step);
                scene.begin(d, 9, in_step);
                PairQuery fresh;
                const auto expected = fresh.intersecting(c, d), found = queries.pairs.intersecting(a, b);
                ASSERT_TRUE(std::ranges::equal(found, expected)) << name(kind) << ", allocation " << n;
                ASSERT_GT(expected.size(), 300u) << name(kind);
            }
            EXPECT_GT(failed, 10) << name(kind);
        }
}

TEST(GrowingContacts, TakeAStepUpAgainWhereMemoryRanOutForItsBoxes) {
    // Rows with room between them, which wide trees copy.
    using Wide = Eigen::Matrix<float, Eigen::Dynamic, 5, Eigen::RowMajor>;
    const GrowingContact scene;
    Wide start(scene.surfaces[8].rows(), 5), end = start;
    start.leftCols<3>() = scene.surfaces[8];
    end.leftCols<3>() = scene.surfaces[9];
    PosedTree boxes(scene.tree, BoundKind::boxes), still(scene.tree, BoundKind::boxes);
    boxes.begin_step(scene.surfaces[8], scene.surfaces[9]);
    still.begin_pose(scene.surfaces[10]);
    PairQuery query;
    const auto sorted = [](std::span<const FacePair> pairs) {
        std::vector<FacePair> result(pairs.begin(), pairs.end());
        std::ranges::sort(result);
        return result;
    };
    const std::vector<FacePair> expected = sorted(query.boxes_within(boxes, still, 0.01f));
    ASSERT_GT(expected.size(), 300u);
    int failed = 0;
    for (bool fails = true; fails; ++failed) {
        PosedTree a(scene.tree, BoundKind::exact);
        a.begin_step(VertexView(start.data(), start.rows(), 5), VertexView(end.data(), end.rows(), 5));
        fails_at = allocations + failed + 1;
        fails = false;
        try {
            query.boxes_within(a, still, 0.01f);
        } catch (const std::bad_alloc&) {
            fails = true;
        }
        fails_at = -1;
        ASSERT_EQ(sorted(query.boxes_within(a, still, 0.01f)), expected) << "allocation " << failed + 1;
    }
    EXPECT_GT(failed, 10);
}

}  // namespace
}  // namespace nbd

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "collision/base/counter_random.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"
#include "collision/tree/posed_tree.hpp"
#include "tests/differential/compare.hpp"
#include "tests/differential/exact_grid.hpp"

namespace nbd::test {
namespace {

constexpr std::array kinds{BoundKind::exact, BoundKind::boxes, BoundKind::affine};
constexpr int soups = 32;

/// A soup of triangles with its trees and poses, one for each kind of bounds.
struct Soup {
    Faces F;
    Vertices x;
    std::vector<PosedTree> posed;
    std::vector<GridTriangle> triangles;
};

/// Random grid points; those of the first axis begin at `shift`.
void draw(CounterRandom& random, int width, int shift, Vertices& x) {
    for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] = static_cast<float>(random.index(width + 1));
    x.col(0).array() += static_cast<float>(shift);
}

Soup make_soup(std::uint64_t seed, int number) {
    CounterRandom random(seed, number);
    Soup soup;
    const int vertices = 6 + random.index(40), faces = 8 + random.index(33);
    soup.x.resize(vertices, 3);
    draw(random, 1000, 0, soup.x);
    soup.F.resize(faces, 3);
    for (int f = 0; f < faces; ++f) {
        const int a = random.index(vertices), b = random.index(vertices - 1), c = random.index(vertices - 2);
        const int second = b + (b >= a);
        soup.F.row(f) << a, second, c;  // made distinct below
        for (const int other : {std::min(a, second), std::max(a, second)})
            if (soup.F(f, 2) >= other) ++soup.F(f, 2);
    }
    CollisionTree tree = make_exact_tree(soup.x, soup.F, {.depth = 3});
    SurfaceEmbedding W(vertices, vertices);
    W.setIdentity();
    hang_on_nodes(tree, W, soup.x);
    const auto shared = std::make_shared<const CollisionTree>(std::move(tree));
    for (const BoundKind kind : kinds) soup.posed.emplace_back(shared, kind);
    soup.triangles.resize(faces);
    return soup;
}

void begin_pose(CounterRandom& random, int width, int shift, Soup& soup) {
    draw(random, width, shift, soup.x);
    for (std::size_t k = 0; k < kinds.size(); ++k)
        kinds[k] == BoundKind::affine ? soup.posed[k].begin_pose_of_nodes(soup.x)
                                      : soup.posed[k].begin_pose(soup.x);
    for (Eigen::Index f = 0; f < soup.F.rows(); ++f)
        for (int c = 0; c < 3; ++c)
            soup.triangles[f][c] = soup.x.row(soup.F(f, c)).transpose().cast<std::int64_t>();
}

std::vector<FacePair> expected_pairs(const Soup& a, const Soup& b) {
    std::vector<FacePair> pairs;
    for (int f = 0; f < a.F.rows(); ++f)
        for (int g = 0; g < b.F.rows(); ++g)
            if (grid_triangles_intersect(a.triangles[f], b.triangles[g])) pairs.push_back({f, g});
    return pairs;
}

std::vector<FacePair> expected_pairs(const Soup& soup) {
    std::vector<FacePair> pairs = expected_pairs(soup, soup);
    std::erase_if(pairs, [&](const FacePair& pair) {
        if (pair.a >= pair.b) return true;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                if (soup.F(pair.a, i) == soup.F(pair.b, j)) return true;
        return false;
    });
    return pairs;
}

}  // namespace

Comparison compare_queries(std::uint64_t seed, long cases) {
    Comparison comparison;
    std::vector<Soup> all;
    for (int i = 0; i < soups; ++i) all.push_back(make_soup(seed, i));
    PairQuery pair_query;
    SelfQuery self_query;
    const auto compare = [&](std::span<const FacePair> found, const std::vector<FacePair>& expected,
                             const std::string& what) {
        ++comparison.cases;
        comparison.hits += !expected.empty();
        if (std::ranges::equal(found, expected)) return;
        if (comparison.different++ == 0)
            comparison.first = fmt::format("{}: {} pairs instead of {}", what, found.size(), expected.size());
    };
    for (std::uint64_t round = 0; comparison.cases < cases; ++round) {
        CounterRandom random(seed, soups + round);
        const int width = 1 + random.index(24), first = random.index(soups);
        Soup &a = all[first], &b = all[(first + 1 + random.index(soups - 1)) % soups];
        begin_pose(random, width, 0, a);
        begin_pose(random, width, width - 1 + random.index(3), b);
        const auto pairs = expected_pairs(a, b), own = expected_pairs(a);
        for (std::size_t k = 0; k < kinds.size(); ++k) {
            const auto what = fmt::format("round {}, {}", round, name(kinds[k]));
            compare(pair_query.intersecting(a.posed[k], b.posed[k]), pairs, what);
            compare(self_query.intersecting(a.posed[k]), own, what + " of one body");
        }
        const std::size_t k = round % kinds.size();
        compare(pair_query.intersecting(a.posed[k], b.posed[(k + 1) % kinds.size()]), pairs,
                fmt::format("round {}, mixed bounds", round));
    }
    return comparison;
}

}  // namespace nbd::test

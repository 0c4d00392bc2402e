// Prints a line for each pair of bodies and each pair of exact bounds: how many pairs of faces each query
// finds, and a hash of them. tests/arm compares what it prints on two processors. Bodies and poses come from
// sums, products, quotients and roots alone, which every processor rounds alike. All kernels of this machine
// must agree: exit status 1 if they do not.
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <utility>

#include "collision/kernels/kernels.hpp"
#include "collision/query/closest_query.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"
#include "tests/collision/wide_tree/hung_surface.hpp"

namespace nbd {
namespace {

constexpr std::pair<BoundKind, BoundKind> mixes[] = {
    {BoundKind::affine, BoundKind::affine}, {BoundKind::boxes, BoundKind::boxes},
    {BoundKind::exact, BoundKind::exact},   {BoundKind::automatic, BoundKind::automatic},
    {BoundKind::affine, BoundKind::boxes},  {BoundKind::exact, BoundKind::affine},
};

/// FNV-1a.
class Hash {
 public:
    void add(std::uint32_t word) noexcept {
        for (int byte = 0; byte < 4; ++byte) hash_ = (hash_ ^ (word >> 8 * byte & 0xff)) * 0x100000001b3u;
    }
    void add(const Vertices& x) noexcept {
        for (const float number : x.reshaped()) add(std::bit_cast<std::uint32_t>(number));
    }
    void add(std::span<const FacePair> pairs) noexcept {
        for (const FacePair& pair : pairs) {
            add(static_cast<std::uint32_t>(pair.a));
            add(static_cast<std::uint32_t>(pair.b));
        }
    }
    unsigned long long value() const noexcept { return hash_; }

 private:
    std::uint64_t hash_ = 0xcbf29ce484222325u;
};

/// A ball: the surface of a cube of n x n squares a side, each corner moved to the sphere of radius 0.5.
shapes::Surface ball(int n) {
    const int line = n + 1;
    shapes::Surface s{Vertices(6 * line * line, 3), Faces(12 * n * n, 3)};
    for (int side = 0; side < 6; ++side)
        for (int i = 0; i <= n; ++i)
            for (int j = 0; j <= n; ++j) {
                const double up = side % 2 == 0 ? 1 : -1, u = 2.0 * i / n - 1, v = 2.0 * j / n - 1;
                const double size = 0.5 / std::sqrt(1 + u * u + v * v);
                const int row = (side * line + i) * line + j, axis = side / 2;
                s.X(row, axis) = static_cast<float>(size * up);
                s.X(row, (axis + 1) % 3) = static_cast<float>(size * u * up);
                s.X(row, (axis + 2) % 3) = static_cast<float>(size * v);
                if (i == n || j == n) continue;
                const int face = 2 * ((side * n + i) * n + j);
                s.F.row(face) << row, row + line, row + line + 1;
                s.F.row(face + 1) << row, row + line + 1, row + 1;
            }
    return s;
}

/// Nodes in pose `round`: twisted about z, squeezed along it, and moved. A turn by the angle whose half has
/// the tangent t needs no sine.
Vertices posed(const Vertices& rest, int round, std::mt19937& random) {
    const float twist = 4 * shapes::uniform(random), squeeze = round % 3 == 2 ? 0.01f : 1;
    const Eigen::Vector3f by = 0.4f * shapes::uniform3(random);
    Vertices x = rest;
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
        const float t = twist * rest(i, 2), d = 1 + t * t, c = (1 - t * t) / d, s = 2 * t / d;
        x(i, 0) = c * rest(i, 0) - s * rest(i, 1) + by[0];
        x(i, 1) = s * rest(i, 0) + c * rest(i, 1) + by[1];
        x(i, 2) = squeeze * rest(i, 2) + by[2] + 0.02f * shapes::uniform(random);
    }
    return x;
}

void begin(PosedTree& tree, const Vertices& x, const Vertices& nodes) {
    if (tree.takes_nodes())
        tree.begin_pose_of_nodes(nodes);
    else
        tree.begin_pose(x);
}

/// What the queries find: numbers of pairs, and hashes.
std::string answers(const std::shared_ptr<const CollisionTree>& tree, const SurfaceEmbedding& W,
                    const Vertices (&nodes)[2], const std::pair<BoundKind, BoundKind>& mix) {
    PosedTree a(tree, mix.first), b(tree, mix.second);
    const Vertices x[2] = {embedded(W, nodes[0]), embedded(W, nodes[1])};
    begin(a, x[0], nodes[0]);
    begin(b, x[1], nodes[1]);
    PairQuery query;
    SelfQuery self;
    std::string line;
    const auto add = [&](const char* what, std::span<const FacePair> pairs) {
        Hash hash;
        hash.add(pairs);
        char text[80];
        std::snprintf(text, sizeof text, "  %s %zu %016llx", what, pairs.size(), hash.value());
        line += text;
    };
    add("meet", query.intersecting(a, b));
    add("within", query.within(a, b, 0.01f));
    add("self", self.intersecting(a));
    const auto closest = ClosestQuery().closest(a, b);
    char text[80];
    std::snprintf(text, sizeof text, "  closest %a", closest->points.distance);
    return line + text;
}

/// Prints the answers for some poses of one body. Returns whether the kernels disagree.
bool print_answers(const char* body, const test::HungSurface& hung, int rounds) {
    CollisionTree made = make_exact_tree(hung.surface.X, hung.surface.F, {.depth = 4});
    hang_on_nodes(made, hung.W, hung.rest);
    const auto tree = std::make_shared<const CollisionTree>(std::move(made));
    std::mt19937 random(7);
    bool differ = false;
    for (int round = 0; round < rounds; ++round) {
        const Vertices nodes[2] = {posed(hung.rest, round, random), posed(hung.rest, round, random)};
        Hash positions;
        for (const Vertices& x : nodes) positions.add(embedded(hung.W, x));
        std::printf("%s, pose %d, positions %016llx\n", body, round, positions.value());
        for (const auto& mix : mixes) {
            std::string first;
            for (const InstructionSet set : instruction_sets) {
                const Kernels* form = kernels_for(set);
                if (!form) continue;
                use_kernels(*form);
                const std::string found = answers(tree, hung.W, nodes, mix);
                if (first.empty()) first = found;
                if (found == first) continue;
                differ = true;
                std::fprintf(stderr, "kernels %s find%s, plain ones%s\n", name(set), found.c_str(),
                             first.c_str());
            }
            const std::string kinds =
                std::string(name(mix.first)) + " against " + std::string(name(mix.second));
            std::printf("%s:%s\n", kinds.c_str(), first.c_str());
        }
    }
    return differ;
}

}  // namespace
}  // namespace nbd

int main() {
    using namespace nbd;
    bool differ = print_answers("ball in cubes", test::hung_on_lattice(ball(12), 3), 12);
    differ |= print_answers("ball in tetrahedra", test::hung_on_tets(ball(12), 4), 12);
    for (const InstructionSet set : instruction_sets)
        if (kernels_for(set)) std::fprintf(stderr, "kernels %s\n", name(set));
    return differ;
}

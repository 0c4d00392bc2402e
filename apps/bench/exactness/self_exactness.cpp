#include "apps/bench/exactness/self_exactness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "apps/bench/exactness/swept_pairs.hpp"
#include "apps/bench/measure/machine.hpp"
#include "collision/base/counter_random.hpp"
#include "collision/base/stopwatch.hpp"
#include "collision/neighbours/neighbour_proof.hpp"
#include "collision/query/self_query.hpp"

namespace nbd {
namespace {

constexpr std::array self_poses{WildPose::twisted, WildPose::crushed, WildPose::inverted, WildPose::bent};

std::vector<FacePair> reference(const Vertices& x, const Faces& F, float distance) {
    std::vector<FacePair> pairs = swept_pairs(x, F, x, F, distance);
    std::erase_if(pairs, [&](const FacePair& pair) {
        if (pair.a >= pair.b) return true;
        const auto a = F.row(pair.a), b = F.row(pair.b);
        return std::any_of(a.begin(), a.end(), [&](int v) { return (b.array() == v).any(); });
    });
    return pairs;
}

/// A region around a leaf reaches as far as about four faces.
std::shared_ptr<const RestNeighbours> rest_neighbours(const BenchBody& body, const WideTree& tree) {
    const SurfaceBody& surface = body.surface;
    const Nodes X = embedded(surface.W, surface.solid.X.cast<float>()).cast<double>();
    double edges = 0;
    for (Eigen::Index f = 0; f < surface.F.rows(); ++f)
        edges += (X.row(surface.F(f, 0)) - X.row(surface.F(f, 1))).norm();
    const double radius = 4 * edges / static_cast<double>(surface.F.rows());
    return std::make_shared<const RestNeighbours>(X, surface.F, tree, nullptr, 0, radius);
}

/// Milliseconds.
template <class Work>
double timed(const Work& work) {
    const Stopwatch watch;
    work();
    return watch.microseconds() / 1e3;
}

}  // namespace

std::vector<SelfExactnessRow> check_self_exactness(const BenchBody& body, const ExactnessConfig& config,
                                                   const std::function<void(int)>& done) {
    const SurfaceBody& surface = body.surface;
    std::vector<SelfExactnessRow> rows;
    for (const WildPose pose : self_poses) rows.push_back({.pose = pose, .faces = body.faces()});
    PosedTree exact(body.tree, BoundKind::exact), boxes(body.tree, BoundKind::boxes),
        affine(body.tree, BoundKind::affine);
    SelfQuery query;
    NeighbourProof proof(rest_neighbours(body, *boxes.box_tree()));
    for (int scene = 0; scene < config.scenes; ++scene) {
        SelfExactnessRow& row = rows[static_cast<std::size_t>(scene) % rows.size()];
        CounterRandom random(config.seed, static_cast<std::uint64_t>(scene));
        const auto distance = static_cast<std::size_t>(scene) / rows.size() % 4 == 3
                                  ? static_cast<float>(std::pow(10, random.uniform(-4, -2.5)))
                                  : 0.0f;
        const Vertices nodes = draw_wild_scene(surface.solid.X.cast<float>(), row.pose, 0.5, random).a;
        Vertices x;
        apply_embedding(surface.W, nodes, x);
        std::vector<FacePair> truth;
        row.reference_ms += timed([&] { truth = reference(x, surface.F, distance); });
        ++row.scenes;
        row.pairs += static_cast<long>(truth.size());
        const auto compare = [&](PosedTree& tree) {
            const auto found = distance > 0 ? query.within(tree, distance) : query.intersecting(tree);
            ++row.queries;
            row.different += !std::ranges::equal(found, truth);
        };
        exact.begin_pose(x);
        compare(exact);
        affine.begin_pose_of_nodes(nodes);
        compare(affine);
        row.walk_ms += timed([&] {
            boxes.begin_pose(x);
            compare(boxes);
        });
        row.tests_per_face +=
            static_cast<double>(query.counters().node_tests + query.counters().box_tests) / row.faces;
        row.proof_ms += timed([&] { proof.prove(x.cast<double>(), {}, {.apart = double{distance}}); });
        row.proved += proof.proved() / static_cast<double>(proof.leaves());
        query.use(&proof);
        row.proved_walk_ms += timed([&] {
            boxes.begin_pose(x);
            compare(boxes);
        });
        query.use(nullptr);
        done(scene + 1);
    }
    for (SelfExactnessRow& row : rows)
        for (double* sum : {&row.reference_ms, &row.walk_ms, &row.proof_ms, &row.proved, &row.proved_walk_ms,
                            &row.tests_per_face})
            *sum /= std::max(row.scenes, 1);
    return rows;
}

std::string to_csv(std::span<const std::string> bodies, std::span<const std::vector<SelfExactnessRow>> rows) {
    std::string text = fmt::format(
        "# {}\nbody,faces,poses,scenes,pairs,queries,different,reference_ms,walk_ms,tests_per_face,"
        "proof_ms,proved,proved_walk_ms\n",
        this_machine());
    for (std::size_t i = 0; i < bodies.size(); ++i)
        for (const SelfExactnessRow& r : rows[i])
            text +=
                fmt::format("{},{},{},{},{},{},{},{:.2f},{:.2f},{:.1f},{:.2f},{:.3f},{:.2f}\n", bodies[i],
                            r.faces, name(r.pose), r.scenes, r.pairs, r.queries, r.different, r.reference_ms,
                            r.walk_ms, r.tests_per_face, r.proof_ms, r.proved, r.proved_walk_ms);
    return text;
}

}  // namespace nbd

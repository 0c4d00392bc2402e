#include "training/evaluate/contact_scenes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "collision/query/missing_pairs.hpp"
#include "collision/query/pair_query.hpp"
#include "training/evaluate/contact_placement.hpp"

namespace nbd {
namespace {

/// Surface in a recorded frame, relative to its own centre.
Vertices centred_pose(const SurfaceBody& body, const RecordingReader& recording, FrameId frame) {
    Vertices nodes, x;
    recording.read(frame.trajectory, frame.frame, 1, nodes);
    apply_embedding(body.W, nodes, x);
    const Eigen::RowVector3f centre = x.colwise().mean();
    x.rowwise() -= centre;
    return x;
}

/// Two surfaces that intersect, or nearly do.
struct Scene {
    Vertices a, b;
};

/// Makes scenes; finds where surfaces touch with `exact` bounds.
class SceneMaker {
 public:
    SceneMaker(const SurfaceBody& body, const std::shared_ptr<const CollisionTree>& tree, double deepest)
        : body_(body), deepest_(deepest * static_cast<double>(tree->spheres.rest[0].r)), approach_(tree) {}

    Scene make(const RecordingReader& recording, std::span<const FrameId> frames, CounterRandom random) {
        const ContactPlacement placement = draw_contact_placement(frames, random);
        Scene scene{centred_pose(body_, recording, placement.first),
                    centred_pose(body_, recording, placement.second) * placement.turn.transpose()};
        approach_.start(scene.a, scene.b, placement.from);
        const float depth = static_cast<float>(random.unit() * deepest_);
        scene.b.rowwise() += std::max(0.f, approach_.touching_distance() - depth) * placement.from;
        return scene;
    }

 private:
    const SurfaceBody& body_;
    double deepest_;
    Approach approach_;
};

/// One bound, posed for both bodies, and its results.
struct Candidate {
    PosedTree a, b;
    PairQuery query{};
    ContactScenesRow row{};
    std::vector<double> pairs{}, missed{};  // one number per scene

    void add(const Scene& scene, std::span<const FacePair> truth, long exact_leaf_pairs) {
        a.begin_pose(scene.a);
        b.begin_pose(scene.b);
        const long lost = missing_pairs(truth, query.intersecting(a, b));
        row.scenes += 1;
        row.scenes_missing += lost > 0;
        row.face_pairs += static_cast<long>(truth.size());
        row.missed += lost;
        missed.push_back(static_cast<double>(lost));
        const QueryCounters& count = query.counters();
        row.nodes_bounded += static_cast<double>(count.nodes_bounded);
        row.leaf_pairs += static_cast<double>(count.leaf_pairs);
        row.exact_leaf_pairs += static_cast<double>(exact_leaf_pairs);
        row.out_of_range += static_cast<double>(count.nodes_out_of_range);
    }
};

}  // namespace

std::vector<ContactScenesRow> check_contact_scenes(const SurfaceBody& body,
                                                   const std::shared_ptr<const CollisionTree>& tree,
                                                   std::span<const BoundKind> kinds,
                                                   const RecordingReader& recording,
                                                   std::span<const FrameId> frames,
                                                   const ContactScenesConfig& config) {
    if (config.scenes < 1 || !(config.deepest > 0 && config.deepest <= 1))
        throw std::invalid_argument(
            fmt::format("{} contact scenes {} radii deep; allowed: 1 or more, and above 0 to 1",
                        config.scenes, config.deepest));
    if (frames.empty()) throw std::invalid_argument("no frames to make contact scenes from");
    SceneMaker maker(body, tree, config.deepest);
    Candidate exact{PosedTree(tree, BoundKind::exact), PosedTree(tree, BoundKind::exact)};
    std::vector<Candidate> candidates;
    for (const BoundKind kind : kinds)
        if (has_bounds(*tree, kind)) {
            candidates.push_back({PosedTree(tree, kind), PosedTree(tree, kind)});
            candidates.back().row.bound = kind;
        }
    for (int s = 0; s < config.scenes; ++s) {
        const Scene scene =
            maker.make(recording, frames, CounterRandom(config.seed, static_cast<std::uint64_t>(s)));
        exact.a.begin_pose(scene.a);
        exact.b.begin_pose(scene.b);
        const std::span<const FacePair> truth = exact.query.intersecting(exact.a, exact.b);
        if (truth.empty()) continue;
        for (Candidate& candidate : candidates)
            candidate.add(scene, truth, exact.query.counters().leaf_pairs);
    }
    std::vector<ContactScenesRow> rows;
    for (Candidate& candidate : candidates) {
        ContactScenesRow& row = candidate.row;
        if (row.scenes == 0) throw std::runtime_error("no contact scene in which the bodies intersect");
        const double scenes = row.scenes, pairs = static_cast<double>(row.face_pairs) / scenes;
        const Interval missed = mean_interval(candidate.missed);
        row.missed_share = {missed.low / pairs, missed.high / pairs};
        for (double* mean : {&row.nodes_bounded, &row.leaf_pairs, &row.exact_leaf_pairs, &row.out_of_range})
            *mean /= scenes;
        rows.push_back(row);
    }
    return rows;
}

std::string to_csv(const std::vector<ContactScenesRow>& rows) {
    std::string text =
        "bound,scenes,scenes_missing,face_pairs,missed,missed_share_low,missed_share_high,nodes_bounded,"
        "leaf_pairs,exact_leaf_pairs,nodes_out_of_range\n";
    for (const ContactScenesRow& r : rows)
        text +=
            fmt::format("{},{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}\n", name(r.bound), r.scenes,
                        r.scenes_missing, r.face_pairs, r.missed, r.missed_share.low, r.missed_share.high,
                        r.nodes_bounded, r.leaf_pairs, r.exact_leaf_pairs, r.out_of_range);
    return text;
}

std::string to_text(const std::vector<ContactScenesRow>& rows) {
    std::string text =
        "contact scenes of two bodies\n"
        "  bound      scenes  that miss  face pairs  missed  found %   [95 % interval]       leaf pairs, "
        "exact  "
        "nodes bounded  out of range\n";
    for (const ContactScenesRow& r : rows) {
        const double missed = static_cast<double>(r.missed) / static_cast<double>(r.face_pairs);
        text += fmt::format(
            "  {:<9}  {:6}  {:9}  {:10}  {:6}  {:8.4f}  [{:.4f}, {:.4f}]  {:10.1f}, {:.1f}  {:13.1f}  "
            "{:12.2f}\n",
            name(r.bound), r.scenes, r.scenes_missing, r.face_pairs, r.missed, 100 * (1 - missed),
            100 * (1 - r.missed_share.high), 100 * (1 - r.missed_share.low), r.leaf_pairs, r.exact_leaf_pairs,
            r.nodes_bounded, r.out_of_range);
    }
    return text;
}

}  // namespace nbd

#include "training/evaluate/contact_scenes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "collision/base/stop.hpp"
#include "collision/geometry/face_pair_set.hpp"
#include "meshing/progress/progress.hpp"

namespace nbd {
namespace {

FrameId draw_other(std::span<const FrameId> frames, FrameId first, CounterRandom& random) {
    const bool several = frames.front().trajectory != frames.back().trajectory;
    for (;;) {
        const FrameId frame = frames[random.index(frames.size())];
        if (!several || frame.trajectory != first.trajectory) return frame;
    }
}

/// A surface and the nodes that it hangs on.
struct Pose {
    Vertices x, nodes;
};

/// A recorded frame, relative to the centre of its surface.
Pose centred_pose(const SurfaceBody& body, const RecordingReader& recording, FrameId frame) {
    Pose pose;
    recording.read(frame.trajectory, frame.frame, 1, pose.nodes);
    apply_embedding(body.W, pose.nodes, pose.x);
    const Eigen::RowVector3f centre = pose.x.colwise().mean();
    pose.x.rowwise() -= centre;
    pose.nodes.rowwise() -= centre;
    return pose;
}

/// Two surfaces that intersect, or nearly do.
struct Scene {
    Pose a, b;
};

/// Makes scenes; finds where surfaces touch with `exact` bounds.
class SceneMaker {
 public:
    /// from_nodes: whether the surfaces are exactly those of the nodes, as `affine` bounds compute them; else
    /// they may differ by rounding.
    SceneMaker(const SurfaceBody& body, const std::shared_ptr<const CollisionTree>& tree, double deepest,
               bool from_nodes)
        : body_(body),
          deepest_(deepest * static_cast<double>(tree->spheres.rest[0].r)),
          from_nodes_(from_nodes),
          approach_(tree) {}

    Scene make(const RecordingReader& recording, std::span<const FrameId> frames, CounterRandom random) {
        const ContactPlacement placement = draw_contact_placement(frames, random);
        Scene scene{centred_pose(body_, recording, placement.first),
                    centred_pose(body_, recording, placement.second)};
        for (Vertices* points : {&scene.b.x, &scene.b.nodes}) *points *= placement.turn.transpose();
        approach_.start(scene.a.x, scene.b.x, placement.from);
        const float depth = random.unit() * deepest_;
        const float distance = std::max(0.f, approach_.touching_distance() - depth);
        for (Vertices* points : {&scene.b.x, &scene.b.nodes}) points->rowwise() += distance * placement.from;
        if (from_nodes_)
            for (Pose* pose : {&scene.a, &scene.b}) apply_embedding(body_.W, pose->nodes, pose->x);
        return scene;
    }

 private:
    const SurfaceBody& body_;
    double deepest_;
    bool from_nodes_;
    Approach approach_;
};

/// One bound, posed for both bodies, and its results.
struct Candidate {
    PosedTree a, b;
    PairQuery query{};
    ContactScenesRow row{};
    std::vector<double> pairs{}, missed{};  // one number per scene

    void begin_poses(const Scene& scene) {
        begin_pose(a, scene.a);
        begin_pose(b, scene.b);
    }
    static void begin_pose(PosedTree& tree, const Pose& pose) {
        if (tree.takes_nodes())
            tree.begin_pose_of_nodes(pose.nodes);
        else
            tree.begin_pose(pose.x);
    }

    void add(const Scene& scene, std::span<const FacePair> truth, long exact_leaf_pairs) {
        begin_poses(scene);
        const long lost = missing_pairs(truth, query.intersecting(a, b));
        row.scenes += 1;
        row.scenes_missing += lost > 0;
        row.face_pairs += truth.size();
        row.missed += lost;
        missed.push_back(static_cast<double>(lost));
        const QueryCounters& count = query.counters();
        row.nodes_bounded += count.nodes_bounded;
        row.leaf_pairs += count.leaf_pairs;
        row.exact_leaf_pairs += exact_leaf_pairs;
        row.out_of_range += count.nodes_out_of_range;
    }
};

}  // namespace

ContactPlacement draw_contact_placement(std::span<const FrameId> frames, CounterRandom& random) {
    ContactPlacement placement;
    placement.first = frames[random.index(frames.size())];
    placement.second = draw_other(frames, placement.first, random);
    placement.turn = random.orientation().toRotationMatrix().cast<float>();
    placement.from = random.direction().cast<float>().transpose();
    return placement;
}

Approach::Approach(const std::shared_ptr<const CollisionTree>& tree)
    : a_(tree, BoundKind::exact), b_(tree, BoundKind::exact) {}

void Approach::start(const Vertices& a, const Vertices& b, const Eigen::RowVector3f& from) {
    first_ = a;
    turned_ = b;
    from_ = from;
    a_.begin_pose(first_);
}

std::span<const FacePair> Approach::pairs_at(float distance) {
    placed_ = turned_.rowwise() + distance * from_;
    b_.begin_pose(placed_);
    return query_.intersecting(a_, b_);
}

float Approach::touching_distance() {
    float near = 0, far = first_.rowwise().norm().maxCoeff() + turned_.rowwise().norm().maxCoeff();
    for (int i = 0; i < 12; ++i) {
        const float middle = 0.5f * (near + far);
        (pairs_at(middle).empty() ? far : near) = middle;
    }
    return near;
}

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
    SceneMaker maker(body, tree, config.deepest, tree->affine && std::ranges::any_of(kinds, reads_nodes));
    Candidate exact{PosedTree(tree, BoundKind::exact), PosedTree(tree, BoundKind::exact)};
    std::vector<Candidate> candidates;
    for (const BoundKind kind : kinds)
        if (has_bounds(*tree, kind)) {
            candidates.push_back({PosedTree(tree, kind), PosedTree(tree, kind)});
            candidates.back().row.bound = kind;
        }
    for (int s = 0; s < config.scenes; ++s) {
        tell_progress("contact scenes", s, config.scenes);
        stop_if_asked();
        const Scene scene =
            maker.make(recording, frames, CounterRandom(config.seed, static_cast<std::uint64_t>(s)));
        exact.begin_poses(scene);
        const std::span<const FacePair> truth = exact.query.intersecting(exact.a, exact.b);
        if (truth.empty()) continue;
        for (Candidate& candidate : candidates)
            candidate.add(scene, truth, exact.query.counters().leaf_pairs);
    }
    tell_progress("contact scenes", config.scenes, config.scenes);
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
        const double missed = static_cast<double>(r.missed) / r.face_pairs;
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

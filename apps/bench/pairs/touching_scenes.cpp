#include "apps/bench/pairs/touching_scenes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

namespace nbd {
namespace {

/// Nodes and surface of a recorded frame, relative to the surface's centre.
struct CentredPose {
    Vertices nodes, x;

    CentredPose(const SurfaceBody& body, const RecordingReader& recording, FrameId frame) {
        recording.read(frame.trajectory, frame.frame, 1, nodes);
        apply_embedding(body.W, nodes, x);
        const Eigen::RowVector3f centre = x.colwise().mean();
        nodes.rowwise() -= centre;
        x.rowwise() -= centre;
    }

    void turn(const Eigen::Matrix3f& R) {
        nodes = (nodes * R.transpose()).eval();
        x = (x * R.transpose()).eval();
    }
};

/// How far the second body moves on until enough faces intersect, and their number of pairs.
struct Overlap {
    float depth;
    int pairs;
};

std::optional<Overlap> find_overlap(Approach& approach, float touching, float radius, int wanted) {
    constexpr int steps = 400;
    for (int i = 0; i < steps; ++i) {
        const float depth = radius * static_cast<float>(i) / steps;
        if (depth > touching) break;
        const int pairs = approach.pairs_at(touching - depth).size();
        if (pairs > wanted + wanted / 2) break;
        if (pairs >= wanted) return Overlap{depth, pairs};
    }
    return std::nullopt;
}

}  // namespace

std::vector<TouchingScene> make_touching_scenes(const BenchBody& coarse, const RecordingReader& recording,
                                                std::span<const FrameId> frames,
                                                const TouchingScenesConfig& config) {
    if (config.scenes < 1 || config.pairs < 1)
        throw std::invalid_argument(fmt::format("{} scenes of {} face pairs; allowed: 1 or more of each",
                                                config.scenes, config.pairs));
    if (frames.empty()) throw std::invalid_argument("no frames to make scenes of");
    Approach approach(coarse.tree);
    std::vector<TouchingScene> scenes;
    const float radius = coarse.tree->spheres.rest[0].r;
    const int max_draws = 50 * config.scenes;
    for (int draw = 0; std::ssize(scenes) < config.scenes; ++draw) {
        if (draw == max_draws)
            throw std::runtime_error(
                fmt::format("{} draws gave {} of {} scenes with {} to {} intersecting faces", draw,
                            scenes.size(), config.scenes, config.pairs, config.pairs + config.pairs / 2));
        CounterRandom random(config.seed, draw);
        const ContactPlacement drawn = draw_contact_placement(frames, random);
        const CentredPose a(coarse.surface, recording, drawn.first);
        CentredPose b(coarse.surface, recording, drawn.second);
        b.turn(drawn.turn);
        approach.start(a.x, b.x, drawn.from);
        const float touching = approach.touching_distance();
        if (const auto overlap = find_overlap(approach, touching, radius, config.pairs)) {
            scenes.push_back({a.nodes, b.nodes, overlap->pairs});
            scenes.back().b.rowwise() += (touching - overlap->depth) * drawn.from;
        }
    }
    return scenes;
}

std::vector<TouchingScene> recorded_scenes(const BenchBody& coarse, const RecordingReader& recording,
                                           float distance, int most) {
    const auto& bodies = recording.trajectories();
    if (bodies.size() != 2 || bodies[0].frames != bodies[1].frames ||
        bodies[0].body_hash != coarse.surface.hash || bodies[1].body_hash != coarse.surface.hash)
        throw std::runtime_error(
            fmt::format("{}: not a recorded scene; allowed: a scene of two copies of the first body",
                        recording.path().string()));
    PosedTree a(coarse.tree, BoundKind::boxes), b(coarse.tree, BoundKind::boxes);
    PairQuery query;
    std::vector<TouchingScene> touching;
    for (int frame = 0; frame < bodies[0].frames; ++frame) {
        TouchingScene scene;
        recording.read(0, frame, 1, scene.a);
        recording.read(1, frame, 1, scene.b);
        Vertices x_a, x_b;
        apply_embedding(coarse.surface.W, scene.a, x_a);
        apply_embedding(coarse.surface.W, scene.b, x_b);
        a.begin_pose(x_a);
        b.begin_pose(x_b);
        if (!query.within(a, b, distance).empty()) touching.push_back(std::move(scene));
    }
    if (touching.empty())
        throw std::runtime_error(fmt::format("{}: the bodies come within {:.3g} m in no frame",
                                             recording.path().string(), distance));
    const int all = touching.size();
    if (all <= most) return touching;
    std::vector<TouchingScene> chosen;
    for (int i = 0; i < most; ++i) chosen.push_back(std::move(touching[i * touching.size() / most]));
    return chosen;
}

std::vector<FrameId> unseen_frames(std::span<const BenchBody> bodies, const RecordingReader& recording) {
    std::vector<FrameId> frames = complete_frames(recording);
    for (const BenchBody& body : bodies) {
        if (body.split.train_trajectories.empty()) continue;
        const std::vector<FrameId> held_out = frames_of(recording, body.split, FrameSet::held_out);
        std::erase_if(frames, [&](FrameId f) { return !std::ranges::binary_search(held_out, f); });
    }
    if (frames.empty())
        throw std::runtime_error(fmt::format("{}: no trajectory was held out of the training of all trees",
                                             recording.path().string()));
    return frames;
}

}  // namespace nbd

#include "apps/bench/pairs/touching_scenes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

namespace nbd {
namespace {

/// Nodes of a recorded frame and the surface they carry, about the surface's centre.
struct CentredPose {
    Vertices nodes, x;

    CentredPose(const SurfaceBody& body, const RecordingReader& recording, FrameId frame) {
        recording.read(frame.trajectory, frame.frame, 1, nodes);
        apply_embedding(body.W, nodes, x);
        const Eigen::RowVector3f centre = x.colwise().mean();
        nodes.rowwise() -= centre;
        x.rowwise() -= centre;
    }
};

/// How far the second body goes on until enough faces intersect, and how many do.
struct Overlap {
    float depth;
    int pairs;
};

std::optional<Overlap> find_overlap(Approach& approach, float touching, float radius, int wanted) {
    constexpr int steps = 400;
    for (int i = 0; i < steps; ++i) {
        const float depth = radius * static_cast<float>(i) / steps;
        if (depth > touching) break;
        const auto pairs = static_cast<int>(approach.pairs_at(touching - depth).size());
        if (pairs > wanted + wanted / 2) break;
        if (pairs >= wanted) return Overlap{depth, pairs};
    }
    return std::nullopt;
}

std::optional<TouchingScene> try_scene(const BenchBody& coarse, const RecordingReader& recording,
                                       std::span<const FrameId> frames, int wanted, Approach& approach,
                                       CounterRandom& random) {
    const ContactPlacement placement = draw_contact_placement(frames, random);
    const CentredPose a(coarse.surface, recording, placement.first),
        b(coarse.surface, recording, placement.second);
    const Vertices turned = b.x * placement.turn.transpose();
    approach.start(a.x, turned, placement.from);
    const float touching = approach.touching_distance();
    const auto overlap = find_overlap(approach, touching, coarse.tree->spheres.rest[0].r, wanted);
    if (!overlap) return std::nullopt;
    TouchingScene scene{a.nodes, b.nodes * placement.turn.transpose(), overlap->pairs, overlap->depth};
    scene.b.rowwise() += (touching - overlap->depth) * placement.from;
    return scene;
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
    const int most_draws = 50 * config.scenes;
    for (int draw = 0; static_cast<int>(scenes.size()) < config.scenes; ++draw) {
        if (draw == most_draws)
            throw std::runtime_error(
                fmt::format("{} draws gave {} of {} scenes with {} to {} intersecting faces", draw,
                            scenes.size(), config.scenes, config.pairs, config.pairs + config.pairs / 2));
        CounterRandom random(config.seed, static_cast<std::uint64_t>(draw));
        if (auto scene = try_scene(coarse, recording, frames, config.pairs, approach, random))
            scenes.push_back(std::move(*scene));
    }
    return scenes;
}

std::vector<FrameId> unseen_frames(std::span<const BenchBody> bodies, const RecordingReader& recording) {
    std::vector<FrameId> frames = complete_frames(recording);
    for (const BenchBody& body : bodies) {
        if (body.split.train_trajectories.empty()) continue;
        const std::vector<FrameId> held_out = frames_of(recording, body.split, FrameSet::held_out);
        std::erase_if(frames, [&](FrameId f) { return !std::ranges::binary_search(held_out, f); });
    }
    if (frames.empty())
        throw std::runtime_error(fmt::format("{}: no trajectory was held out of the training of every tree",
                                             recording.path().string()));
    return frames;
}

}  // namespace nbd

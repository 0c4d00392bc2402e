#include "training/evaluate/evaluate.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "training/evaluate/bound_nodes.hpp"
#include "training/files/recording_hash.hpp"

namespace nbd {

namespace {

/// Sums of one bound over frames; the rows are their means.
struct Sums {
    Eigen::ArrayXXd radius_error, inflation;                              // [margins, depths]
    Eigen::ArrayXd centre_error;                                          // [depths]
    Eigen::Array<long, Eigen::Dynamic, Eigen::Dynamic> outside, missing;  // [margins, depths]
    Eigen::Array<long, Eigen::Dynamic, 1> nodes, vertices;                // [depths]

    Sums(Eigen::Index margins, Eigen::Index depths)
        : radius_error(Eigen::ArrayXXd::Zero(margins, depths)),
          inflation(radius_error),
          centre_error(Eigen::ArrayXd::Zero(depths)),
          outside(decltype(outside)::Zero(margins, depths)),
          missing(decltype(missing)::Zero(margins, depths)),
          nodes(decltype(nodes)::Zero(depths)),
          vertices(nodes) {}

    void operator+=(const Sums& other) {
        radius_error += other.radius_error;
        inflation += other.inflation;
        centre_error += other.centre_error;
        outside += other.outside;
        missing += other.missing;
        nodes += other.nodes;
        vertices += other.vertices;
    }

    /// lost: vertices outside of the bound with each margin.
    void add(const BoundNode& node, const std::vector<double>& margins, std::span<const long> lost) {
        const Eigen::Index depth = node.level;
        const double exact = node.exact.r, size = std::max(node.exact.r, std::numeric_limits<float>::min());
        ++nodes[depth];
        vertices[depth] += node.vertices;
        centre_error[depth] += static_cast<double>((node.sphere.c - node.exact.c).norm()) / size;
        for (std::size_t k = 0; k < margins.size(); ++k) {
            const double r = node.sphere.r * (1 + margins[k]);
            inflation(k, depth) += (r - exact) / size;
            radius_error(k, depth) += std::abs(r - exact) / size;
            outside(k, depth) += lost[k];
            missing(k, depth) += lost[k] > 0;
        }
    }
};

/// One bound and its sums, per slot of the stream.
struct Probe {
    BoundKind kind;
    std::unique_ptr<BoundNodes> bounds;
    Sums sums;

    Probe(const std::shared_ptr<const CollisionTree>& tree, BoundKind bound, Eigen::Index margins)
        : kind(bound), bounds(bound_nodes(tree, bound, 0.f)), sums(margins, bounds->levels()) {}

    void add_frame(VerticesRef x, std::span<const Sphere> exact, const std::vector<double>& margins) {
        std::vector<double> factors;
        for (const double margin : margins) factors.push_back(1 + margin);
        const std::span<const BoundNode> nodes = bounds->pose(x, exact);
        for (std::size_t i = 0; i < nodes.size(); ++i)
            sums.add(nodes[i], margins, bounds->outside(i, x, factors));
    }
};

void check(const SurfaceBody& body, const CollisionTree& tree, std::span<const FrameId> frames,
           const std::string& name, const EvaluateConfig& config) {
    if (config.margins.empty()) throw std::invalid_argument("no margins to evaluate");
    for (const double margin : config.margins)
        if (!(margin >= 0 && std::isfinite(margin)))
            throw std::invalid_argument(fmt::format("margin {}; allowed: 0 or more", margin));
    if (config.max_frames < 0)
        throw std::invalid_argument(fmt::format("max_frames is {}; allowed: 0 or more", config.max_frames));
    if (frames.empty()) throw std::invalid_argument(fmt::format("{}: no frames to evaluate", name));
    if (tree.vertex_count != body.X.rows())
        throw std::invalid_argument(fmt::format("the tree has {} vertices, but the body's surface has {}",
                                                tree.vertex_count, body.X.rows()));
}

void check_bounds(const CollisionTree& tree, const EvaluateConfig& config) {
    std::vector<std::string_view> names;
    for (const BoundKind kind : config.bounds) names.push_back(name(kind));
    for (const BoundKind kind : config.bounds)
        if (is_box(kind) && kind != BoundKind::learned_affine)
            throw std::invalid_argument(
                fmt::format("{} bounds are not those of the tree's nodes, which are evaluated; "
                            "`nbdtree coverage` measures them",
                            name(kind)));
    if (std::ranges::none_of(config.bounds, [&](BoundKind kind) { return has_bounds(tree, kind); }))
        throw std::invalid_argument(fmt::format("the tree has no {} bounds", fmt::join(names, ", ")));
}

}  // namespace

std::vector<EvaluationRow> evaluate_frames(const SurfaceBody& body,
                                           const std::shared_ptr<const CollisionTree>& tree,
                                           const RecordingReader& recording, std::span<const FrameId> frames,
                                           const std::string& name, const EvaluateConfig& config) {
    check(body, *tree, frames, name, config);
    const std::vector<FrameId> chosen =
        spread(frames, config.max_frames > 0 ? config.max_frames : std::numeric_limits<int>::max());
    const Eigen::Index margins = config.margins.size();

    std::vector<std::vector<Probe>> probes(frame_slots);
    std::vector<std::vector<Sphere>> exact(frame_slots);
    for (auto& slot : probes)
        for (const BoundKind kind : config.bounds)
            if (has_bounds(*tree, kind)) slot.emplace_back(tree, kind, margins);
    FrameSource(body.W, recording, 0).for_each_pose(chosen, [&](int slot, int, VerticesRef x, VerticesRef) {
        exact_spheres(tree->spheres, x, exact[slot]);
        for (Probe& probe : probes[slot]) probe.add_frame(x, exact[slot], config.margins);
    });

    const long poses = chosen.size();
    std::vector<EvaluationRow> rows;
    for (std::size_t b = 0; b < probes.front().size(); ++b) {
        const BoundKind kind = probes.front()[b].kind;
        const Eigen::Index depths = probes.front()[b].bounds->levels();
        Sums sums(margins, depths);
        for (const auto& slot : probes) sums += slot[b].sums;
        for (Eigen::Index k = 0; k < margins; ++k)
            for (Eigen::Index d = 0; d < depths; ++d) {
                const long all_nodes = sums.nodes[d], all_vertices = sums.vertices[d];
                const auto per_node = 1 / static_cast<double>(all_nodes);
                rows.push_back({.frames = name,
                                .bound = kind,
                                .depth = static_cast<int>(d),
                                .margin = config.margins[k],
                                .radius_error = sums.radius_error(k, d) * per_node,
                                .inflation = sums.inflation(k, d) * per_node,
                                .centre_error = sums.centre_error[d] * per_node,
                                .vertices_outside = static_cast<double>(sums.outside(k, d)) /
                                                    static_cast<double>(all_vertices),
                                .nodes_missing = static_cast<double>(sums.missing(k, d)) * per_node,
                                .poses = poses,
                                .nodes = all_nodes,
                                .vertices = all_vertices});
            }
    }
    return rows;
}

std::vector<TestFrames> test_frames(const TreeFile& file, const RecordingReader& recording) {
    check_recording(file.facts.body_hash, file.W.cols(), recording);
    std::vector<TestFrames> sets;
    const RecordingHash hashes = hash_recording(recording);
    const TrainingFacts& facts = file.facts;
    const bool own =
        hashes.hex == facts.recording_hash || recording.label("remapped_from_sha256") == facts.recording_hash;
    if (own) {
        sets.push_back({"random frames", frames_of(recording, facts.split, FrameSet::random_test)});
        sets.push_back({"held-out trajectories", frames_of(recording, facts.split, FrameSet::held_out)});
    } else {
        sets.push_back({"other recording", complete_frames(recording)});
        if (!facts.trained_on) tell_unknown(recording);
    }
    // Of its own recording, the split keeps out what training saw, and calibration may have seen more since.
    std::vector<const SeenTrajectories*> seen;
    if (facts.trained_on && !own) seen.push_back(&*facts.trained_on);
    if (facts.calibrated_on) seen.push_back(&*facts.calibrated_on);
    std::vector<int> left_out = known_trajectories(recording, hashes, seen);
    const auto is_left_out = [&](const FrameId& frame) {
        return std::ranges::binary_search(left_out, recording.trajectories()[frame.trajectory].id);
    };
    std::vector<int> told;
    for (const FrameId& frame : sets.back().frames)
        if (const int id = recording.trajectories()[frame.trajectory].id;
            is_left_out(frame) && (told.empty() || told.back() != id))
            told.push_back(id);
    tell_left_out(recording, told, "trained or calibrated on");
    std::erase_if(sets.back().frames, is_left_out);
    std::erase_if(sets, [](const TestFrames& set) { return set.frames.empty(); });
    if (sets.empty())
        throw std::runtime_error(fmt::format(
            "{}: no frames to test on; training and calibration saw all of them", recording.path().string()));
    return sets;
}

std::vector<EvaluationRow> evaluate(const TreeFile& file, const RecordingReader& recording,
                                    const EvaluateConfig& config) {
    check_bounds(file.tree, config);
    const SurfaceBody body = surface_body(file);
    const auto tree = refer_to(file.tree);
    std::vector<EvaluationRow> rows;
    for (const TestFrames& set : test_frames(file, recording)) {
        const auto more = evaluate_frames(body, tree, recording, set.frames, set.name, config);
        rows.insert(rows.end(), more.begin(), more.end());
    }
    return rows;
}

std::string to_csv(const std::vector<EvaluationRow>& rows) {
    std::string text =
        "frames,bound,margin,depth,radius_error,inflation,centre_error,vertices_outside,nodes_missing,"
        "poses,nodes,vertices\n";
    for (const EvaluationRow& r : rows)
        text += fmt::format("{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{},{},{}\n", r.frames,
                            name(r.bound), r.margin, r.depth, r.radius_error, r.inflation, r.centre_error,
                            r.vertices_outside, r.nodes_missing, r.poses, r.nodes, r.vertices);
    return text;
}

std::string to_text(const std::vector<EvaluationRow>& rows) {
    const auto same_block = [](const EvaluationRow& a, const EvaluationRow& b) {
        return a.frames == b.frames && a.bound == b.bound;
    };
    std::string text;
    for (auto begin = rows.begin(); begin != rows.end();) {
        const auto end =
            std::find_if(begin, rows.end(), [&](const EvaluationRow& r) { return !same_block(r, *begin); });
        // Rows of a block come by margin, then by depth.
        const auto depths =
            std::count_if(begin, end, [&](const EvaluationRow& r) { return r.margin == begin->margin; });
        text += fmt::format("{}{}, {} poses, {} bounds; % at margins of", text.empty() ? "" : "\n",
                            begin->frames, begin->poses, name(begin->bound));
        for (auto r = begin; r < end; r += depths) text += fmt::format(" {:g}", 100 * r->margin);
        const auto width = static_cast<int>(9 * ((end - begin) / depths));
        text += fmt::format(" %\n  depth  radius error  inflation  centre error  {:<{}}  nodes that miss\n",
                            "vertices outside", width);
        for (auto first = begin; first < begin + depths; ++first) {
            const auto row = first - begin;
            if (row != 0 && row != depths / 2 && row != depths - 1) continue;
            text += fmt::format("  {:5}  {:12.3f}  {:9.3f}  {:12.3f}  ", first->depth,
                                100 * first->radius_error, 100 * first->inflation, 100 * first->centre_error);
            for (auto r = first; r < end; r += depths)
                text += fmt::format("{:<9.4f}", 100 * r->vertices_outside);
            text += "  ";
            for (auto r = first; r < end; r += depths)
                text += fmt::format("{:<8.2f}", 100 * r->nodes_missing);
            text.erase(text.find_last_not_of(' ') + 1);
            text += '\n';
        }
        begin = end;
    }
    return text;
}

}  // namespace nbd

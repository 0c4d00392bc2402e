#include "training/evaluate/coverage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "training/evaluate/bound_nodes.hpp"

namespace nbd {
namespace {

/// Sums over the nodes of a depth and over poses.
struct DepthSums {
    long nodes = 0, vertices = 0, missing = 0, outside = 0, out_of_range = 0;
    double inflation = 0;

    void operator+=(const DepthSums& other) {
        nodes += other.nodes;
        vertices += other.vertices;
        missing += other.missing;
        outside += other.outside;
        out_of_range += other.out_of_range;
        inflation += other.inflation;
    }
};

void add_pose(BoundNodes& bounds, VerticesRef x, std::span<const Sphere> exact,
              std::vector<DepthSums>& depths) {
    const std::span<const BoundNode> nodes = bounds.pose(x, exact);
    constexpr double as_it_is[] = {1};
    for (std::size_t begin = 0, end; begin < nodes.size(); begin = end) {
        DepthSums bound{.nodes = 1, .out_of_range = nodes[begin].out_of_range};
        for (end = begin; end < nodes.size() && nodes[end].bound == nodes[begin].bound; ++end) {
            bound.vertices += nodes[end].vertices;
            bound.outside += bounds.outside(end, x, as_it_is)[0];
            bound.inflation += nodes[end].inflation;
        }
        bound.missing = bound.outside > 0;
        bound.inflation /= end - begin;
        depths[nodes[begin].level] += bound;
    }
}

double share(long part, long all) { return static_cast<double>(part) / all; }

}  // namespace

std::vector<BoundKind> calibrated_bounds(const CollisionTree& tree) {
    std::vector<BoundKind> kinds;
    for (const auto& [kind, calibration] : tree.calibrations) kinds.push_back(kind);
    if (kinds.empty())
        throw std::invalid_argument(
            "no bounds of the tree are calibrated; calibrate them with: nbdtree calibrate");
    return kinds;
}

void check_has_bounds(const CollisionTree& tree, std::span<const BoundKind> kinds) {
    for (const BoundKind kind : kinds)
        if (!has_bounds(tree, kind))
            throw std::invalid_argument(fmt::format("the tree has no {} bounds", name(kind)));
}

std::vector<CoverageRow> measure_coverage(const SurfaceBody& body,
                                          const std::shared_ptr<const CollisionTree>& tree, BoundKind kind,
                                          const RecordingReader& recording, std::span<const FrameId> frames) {
    const auto calibration = tree->calibrations.find(kind);
    if (calibration == tree->calibrations.end())
        throw std::invalid_argument(
            can_miss(kind)
                ? fmt::format("{} bounds of the tree are not calibrated", name(kind))
                : fmt::format("{} bounds never miss, so they have no coverage to measure", name(kind)));
    if (frames.empty()) throw std::invalid_argument("no frame to measure coverage on");
    std::vector<std::unique_ptr<BoundNodes>> bounds;
    std::vector<std::vector<Sphere>> exact(frame_slots);
    for (int slot = 0; slot < frame_slots; ++slot) bounds.push_back(bound_nodes(tree, kind, {}));
    const std::size_t depths = bounds.front()->levels();
    std::vector<std::vector<DepthSums>> poses(frames.size(), std::vector<DepthSums>(depths));
    FrameSource(body.W, recording, 0).for_each_frame(frames, [&](int slot, int index, VerticesRef x) {
        if (!is_box(kind)) exact_spheres(tree->spheres, x, exact[slot]);
        add_pose(*bounds[slot], x, exact[slot], poses[index]);
    });

    std::vector<CoverageRow> rows;
    for (std::size_t depth = 0; depth < depths; ++depth) {
        DepthSums all;
        std::vector<double> rates;
        for (std::size_t begin = 0, end; begin < frames.size(); begin = end) {
            DepthSums trajectory;
            for (end = begin; end < frames.size() && frames[end].trajectory == frames[begin].trajectory;
                 ++end)
                trajectory += poses[end][depth];
            rates.push_back(share(trajectory.missing, trajectory.nodes));
            all += trajectory;
        }
        CoverageRow row{.bound = kind,
                        .depth = static_cast<int>(depth),
                        .trajectories = static_cast<int>(rates.size()),
                        .poses = static_cast<long>(frames.size()),
                        .miss_rate = calibration->second.miss_rate,
                        .confidence = calibration->second.confidence};
        row.keeping = static_cast<int>(
            std::ranges::count_if(rates, [&](double rate) { return rate <= row.miss_rate + 1e-12; }));
        row.keeping_share = share_interval(row.keeping, row.trajectories);
        for (const double rate : rates) row.nodes_missing += rate / static_cast<double>(rates.size());
        row.nodes_missing_mean = mean_interval(rates);
        row.vertices_outside = share(all.outside, all.vertices);
        row.inflation = all.inflation / static_cast<double>(all.nodes);
        row.out_of_range = share(all.out_of_range, all.nodes);
        rows.push_back(row);
    }
    return rows;
}

std::string to_csv(const std::vector<CoverageRow>& rows) {
    std::string text =
        "bound,depth,stated_miss_rate,stated_confidence,trajectories,poses,trajectories_keeping,keeping_"
        "low,"
        "keeping_high,nodes_missing,nodes_missing_low,nodes_missing_high,vertices_outside,inflation,"
        "out_of_range\n";
    for (const CoverageRow& r : rows)
        text +=
            fmt::format("{},{},{},{:.6g},{},{},{},{:.4f},{:.4f},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}\n",
                        name(r.bound), r.depth, r.miss_rate, r.confidence, r.trajectories, r.poses, r.keeping,
                        r.keeping_share.low, r.keeping_share.high, r.nodes_missing, r.nodes_missing_mean.low,
                        r.nodes_missing_mean.high, r.vertices_outside, r.inflation, r.out_of_range);
    return text;
}

std::string to_text(const std::vector<CoverageRow>& rows) {
    std::string text;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const CoverageRow& r = rows[i];
        if (i == 0 || r.bound != rows[i - 1].bound)
            text += fmt::format(
                "{}{} bounds as calibrated, {} poses of {} trajectories; stated: at most {:g} % of a "
                "depth's "
                "nodes miss, in {:.4g} % of trajectories\n"
                "  depth  nodes that miss %  [95 % interval]    trajectories that keep it  [95 %]     "
                "vertices outside %  inflation %  out of range %\n",
                i == 0 ? "" : "\n", name(r.bound), r.poses, r.trajectories, 100 * r.miss_rate,
                100 * r.confidence);
        text += fmt::format(
            "  {:5}  {:17.4f}  [{:.4f}, {:.4f}]  {:>10} of {:<10}  [{:.0f} %, {:.0f} %]  {:18.5f}  "
            "{:11.2f}  {:14.3f}\n",
            r.depth, 100 * r.nodes_missing, 100 * r.nodes_missing_mean.low, 100 * r.nodes_missing_mean.high,
            r.keeping, r.trajectories, 100 * r.keeping_share.low, 100 * r.keeping_share.high,
            100 * r.vertices_outside, 100 * r.inflation, 100 * r.out_of_range);
    }
    return text;
}

}  // namespace nbd

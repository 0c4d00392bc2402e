#include "apps/figures/body_figures.hpp"

#include <fmt/core.h>

#include <set>

namespace nbd {
namespace {

/// The bounds of a list that the tree has.
std::vector<BoundKind> bounds_of(const CollisionTree& tree, std::vector<BoundKind> bounds) {
    std::erase_if(bounds, [&](BoundKind kind) { return !has_bounds(tree, kind); });
    return bounds;
}

int trajectories_of(const std::vector<FrameId>& frames) {
    std::set<int> seen;
    for (const FrameId& frame : frames) seen.insert(frame.trajectory);
    return static_cast<int>(seen.size());
}

}  // namespace

BodyFigures make_body_figures(const std::string& body, const TreeFile& file, const RecordingReader& recording,
                              int max_frames) {
    const auto tree = refer_to(file.tree);
    const EvaluateConfig config{.bounds = bounds_of(*tree, {BoundKind::nbd, BoundKind::learned_spheres,
                                                            BoundKind::bd, BoundKind::certified}),
                                .margins = chart_margins(),
                                .max_frames = max_frames};
    BodyFigures figures;
    figures.rows.body = body;
    const std::vector<TestFrames> sets = test_frames(file, recording);
    for (const TestFrames& set : sets) {
        const auto rows = evaluate_frames(surface_body(file), tree, recording, set.frames, set.name, config);
        figures.rows.rows.insert(figures.rows.rows.end(), rows.begin(), rows.end());
        figures.sets.push_back({set.name, static_cast<int>(rows.front().poses), trajectories_of(set.frames)});
    }
    figures.pose = typical_pose(file, recording, sets.back().frames);
    // Leaves out `certified` bounds, which need the motion of the tetrahedra.
    figures.spheres = spheres_in_pose(
        tree, figures.pose.x,
        bounds_of(*tree, {BoundKind::nbd, BoundKind::exact, BoundKind::learned_spheres, BoundKind::bd}));
    figures.spheres_page =
        sphere_page(fmt::format("{}: spheres of a test pose ({}: trajectory {}, frame {})", body,
                                sets.back().name, figures.pose.trajectory, figures.pose.frame),
                    *tree, figures.pose.x, figures.spheres);
    return figures;
}

std::vector<CoverageRow> measure_coverages(const TreeFile& file, const RecordingReader& recording,
                                           int max_frames) {
    const auto tree = refer_to(file.tree);
    std::vector<FrameId> frames = test_frames(file, recording).back().frames;
    if (max_frames > 0) frames = spread(frames, max_frames);
    std::vector<CoverageRow> coverage;
    for (const auto& [kind, calibration] : tree->calibrations) {
        const auto rows = measure_coverage(surface_body(file), tree, kind, recording, frames);
        coverage.insert(coverage.end(), rows.begin(), rows.end());
    }
    return coverage;
}

}  // namespace nbd

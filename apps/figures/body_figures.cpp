#include "apps/figures/body_figures.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <vector>

#include "apps/drawing/chart.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

constexpr int looked_at = 65;  // frames to choose from

Vertices aligned(VerticesRef X, VerticesRef x) {
    const RigidTransform align = match_shape(X, x, Eigen::VectorXf::Ones(X.rows()));
    return (x.rowwise() - align.t.transpose()) * align.R;
}

}  // namespace

TestPose typical_pose(const TreeFile& tree, const RecordingReader& recording,
                      std::span<const FrameId> frames) {
    const SurfaceBody body = surface_body(tree);
    const float size = (body.X.colwise().maxCoeff() - body.X.colwise().minCoeff()).norm();
    const std::vector<FrameId> candidates = spread(frames, looked_at);
    std::vector<std::pair<double, FrameId>> deformed(candidates.size());
    const auto deformation = [&](const Vertices& y) {
        return static_cast<double>((y - body.X).rowwise().norm().mean() / size);
    };
    FrameSource(body.W, recording, 0).for_each_frame(candidates, [&](int, int index, VerticesRef x) {
        const std::size_t i = index;
        deformed[i] = {deformation(aligned(body.X, x)), candidates[i]};
    });
    const auto middle = deformed.begin() + deformed.size() / 2;
    std::nth_element(deformed.begin(), middle, deformed.end());

    const FrameId chosen = middle->second;
    const auto& info = recording.trajectories()[chosen.trajectory];
    TestPose pose{info.id, chosen.frame, middle->first, {}};
    FrameSource(body.W, recording, 0).for_each_frame(std::span(&chosen, 1), [&](int, int, VerticesRef x) {
        pose.x = aligned(body.X, x);
    });
    return pose;
}

namespace {

/// The bounds of a list that the tree has.
std::vector<BoundKind> bounds_of(const CollisionTree& tree, std::vector<BoundKind> bounds) {
    std::erase_if(bounds, [&](BoundKind kind) { return !has_bounds(tree, kind); });
    return bounds;
}

int trajectories_of(const std::vector<FrameId>& frames) {
    std::set<int> seen;
    for (const FrameId& frame : frames) seen.insert(frame.trajectory);
    return seen.size();
}

std::vector<double> chart_margins() {
    std::vector<double> margins;
    for (int percent = 0; percent <= 25; ++percent) margins.push_back(percent / 100.0);
    return margins;
}

/// A text as a cell of CSV.
std::string cell(const std::string& text) {
    if (text.find_first_of(",\"\n") == text.npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + '"';
}

void write_text(const std::filesystem::path& path, const std::string& text) {
    h5::AtomicFile file(path);
    file.out() << text;
    file.commit();
}

}  // namespace

std::string to_csv(const std::vector<BodyRows>& bodies) {
    std::string text;
    for (const BodyRows& body : bodies) {
        std::istringstream lines(to_csv(body.rows));
        std::string line;
        std::getline(lines, line);
        if (text.empty()) text = "body," + line + '\n';
        while (std::getline(lines, line)) text += cell(body.body) + ',' + line + '\n';
    }
    return text;
}

BodyFigures make_body_figures(const std::string& body, const TreeFile& file, const RecordingReader& recording,
                              int max_frames) {
    const auto tree = refer_to(file.tree);
    const EvaluateConfig config{.bounds = bounds_of(*tree, {BoundKind::nbd, BoundKind::bd}),
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
    figures.spheres = spheres_in_pose(tree, figures.pose.x,
                                      bounds_of(*tree, {BoundKind::nbd, BoundKind::exact, BoundKind::bd}));
    figures.pictures =
        draw_spheres(fmt::format("{}: spheres of a test pose ({}: trajectory {}, frame {})", body,
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

void write_table_and_charts(const std::filesystem::path& folder, const std::vector<BodyRows>& bodies) {
    const std::filesystem::path table = folder / "bounds.csv";
    write_text(table, to_csv(bodies));
    draw_chart("outside", table, folder / "figure6.png");
    draw_chart("radii", table, folder / "figure7.png");
    for (const BodyRows& body : bodies)
        draw_chart("margins", table, folder / fmt::format("figure8_{}.png", body.body),
                   {"--body=" + body.body});
}

void write_sphere_figure(const std::filesystem::path& folder, const BodyFigures& figures) {
    const std::string stem = "figure10_" + figures.rows.body;
    const h5::ScratchFolder scratch;
    const std::filesystem::path table = folder / (stem + ".csv"), tiles = scratch.path() / "tiles.png";
    write_text(table, to_csv(figures.spheres));
    write_png(tiles, figures.pictures.tiles);
    std::vector<std::string> options{"--title=" + figures.pictures.title, "--tiles=" + tiles.string()};
    for (const std::string& label : figures.pictures.labels) options.push_back("--row=" + label);
    draw_chart("spheres", table, folder / (stem + ".png"), options);
}

}  // namespace nbd

#include "apps/figures/body_figures.hpp"

#include <fmt/core.h>

#include <iomanip>
#include <set>
#include <sstream>

#include "apps/drawing/chart.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

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

}  // namespace

std::string to_csv(const std::vector<BodyRows>& bodies) {
    std::ostringstream text;
    for (const BodyRows& body : bodies) {
        std::istringstream lines(to_csv(body.rows));
        std::string line;
        std::getline(lines, line);
        if (&body == &bodies.front()) text << "body," << line << '\n';
        while (std::getline(lines, line)) text << std::quoted(body.body, '"', '"') << ',' << line << '\n';
    }
    return text.str();
}

BodyFigures make_body_figures(const std::string& body, const TreeFile& file, const RecordingReader& recording,
                              int max_frames) {
    const auto tree = refer_to(file.tree);
    EvaluateConfig config{
        .bounds = {BoundKind::nbd, BoundKind::bd}, .margins = chart_margins(), .max_frames = max_frames};
    std::erase_if(config.bounds, [&](BoundKind kind) { return !has_bounds(*tree, kind); });
    BodyFigures figures;
    figures.rows.body = body;
    const std::vector<TestFrames> sets = test_frames(file, recording);
    for (const TestFrames& set : sets) {
        const auto rows = evaluate_frames(surface_body(file), tree, recording, set.frames, set.name, config);
        figures.rows.rows.insert(figures.rows.rows.end(), rows.begin(), rows.end());
        figures.sets.push_back({set.name, static_cast<int>(rows.front().poses), trajectories_of(set.frames)});
    }
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
    h5::AtomicFile file(table);
    file.out() << to_csv(bodies);
    file.commit();
    draw_chart("outside", table, folder / "figure6.png");
    draw_chart("radii", table, folder / "figure7.png");
    for (const BodyRows& body : bodies)
        draw_chart("margins", table, folder / fmt::format("figure8_{}.png", body.body),
                   {"--body=" + body.body});
}

}  // namespace nbd

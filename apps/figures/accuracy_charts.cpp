#include "apps/figures/accuracy_charts.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <sstream>

namespace nbd {
namespace {

/// Bounds that may leave vertices outside.
bool is_learned(BoundKind kind) { return kind == BoundKind::nbd || kind == BoundKind::learned_spheres; }

Dash dash_of(BoundKind kind) {
    switch (kind) {
        case BoundKind::bd:
            return Dash::dashed;
        case BoundKind::exact:
        case BoundKind::certified:
            return Dash::mixed;
        case BoundKind::nbd:
            return Dash::solid;
        default:
            return Dash::dotted;
    }
}

/// Distinct values of a member over rows, in order of appearance.
template <class T>
std::vector<T> values(const std::vector<EvaluationRow>& rows, T EvaluationRow::*member) {
    std::vector<T> seen;
    for (const EvaluationRow& row : rows)
        if (std::ranges::find(seen, row.*member) == seen.end()) seen.push_back(row.*member);
    return seen;
}

std::vector<double> depth_ticks(const std::vector<BodyRows>& bodies) {
    int deepest = 1;
    for (const BodyRows& body : bodies)
        for (const EvaluationRow& row : body.rows) deepest = std::max(deepest, row.depth);
    std::vector<double> ticks;
    for (int depth = 0; depth <= deepest; ++depth) ticks.push_back(depth);
    return ticks;
}

/// Chart of `value` by depth at margin 0: one panel per set of frames, one line per body and bound that
/// `shown` accepts.
Chart by_depth(const std::vector<BodyRows>& bodies, double EvaluationRow::*value, bool (*shown)(BoundKind)) {
    Chart chart;
    chart.x_label = "depth of the node";
    chart.x_ticks = depth_ticks(bodies);
    std::vector<std::string> sets;
    for (const BodyRows& body : bodies)
        for (const std::string& set : values(body.rows, &EvaluationRow::frames))
            if (std::ranges::find(sets, set) == sets.end()) sets.push_back(set);
    for (const std::string& set : sets) {
        Panel panel{set, {}};
        for (std::size_t b = 0; b < bodies.size(); ++b)
            for (const BoundKind kind : values(bodies[b].rows, &EvaluationRow::bound)) {
                if (!shown(kind)) continue;
                Series series{fmt::format("{}, {}", bodies[b].body, name(kind)),
                              category_colour(static_cast<int>(b)),
                              dash_of(kind),
                              {}};
                for (const EvaluationRow& row : bodies[b].rows)
                    if (row.frames == set && row.bound == kind && row.margin == 0)
                        series.points.push_back({static_cast<double>(row.depth), 100 * row.*value});
                if (!series.points.empty()) panel.series.push_back(std::move(series));
            }
        chart.panels.push_back(std::move(panel));
    }
    chart.columns = static_cast<int>(sets.size());
    return chart;
}

}  // namespace

std::vector<double> chart_margins() {
    std::vector<double> margins;
    for (int percent = 0; percent <= 25; ++percent) margins.push_back(percent / 100.0);
    return margins;
}

Chart outside_by_depth(const std::vector<BodyRows>& bodies) {
    Chart chart = by_depth(bodies, &EvaluationRow::vertices_outside, is_learned);
    chart.title = "Vertices outside their node's sphere";
    chart.y_label = "vertices outside, %";
    return chart;
}

Chart radius_error_by_depth(const std::vector<BodyRows>& bodies) {
    Chart chart = by_depth(bodies, &EvaluationRow::radius_error,
                           [](BoundKind kind) { return kind != BoundKind::exact; });
    chart.title = "Radius error relative to the exact sphere";
    chart.y_label = "mean radius error, %";
    return chart;
}

Chart outside_by_margin(const BodyRows& body) {
    Chart chart;
    chart.title = body.body + ": vertices outside by margin";
    chart.x_label = "margin, % of the radius";
    chart.y_label = "vertices outside, %";
    chart.x_ticks = {0, 5, 10, 15, 20, 25};
    const std::vector<std::string> sets = values(body.rows, &EvaluationRow::frames);
    const std::vector<int> depths = values(body.rows, &EvaluationRow::depth);
    for (const BoundKind kind : values(body.rows, &EvaluationRow::bound)) {
        if (!is_learned(kind)) continue;
        for (const std::string& set : sets) {
            Panel panel{fmt::format("{}, {}", name(kind), set), {}};
            for (const int depth : depths) {
                Series series{fmt::format("depth {}", depth),
                              ramp_colour(depth / std::max(1.0, static_cast<double>(depths.back()))),
                              Dash::solid,
                              {}};
                for (const EvaluationRow& row : body.rows)
                    if (row.frames == set && row.bound == kind && row.depth == depth)
                        series.points.push_back({100 * row.margin, 100 * row.vertices_outside});
                panel.series.push_back(std::move(series));
            }
            chart.panels.push_back(std::move(panel));
        }
    }
    chart.columns = static_cast<int>(sets.size());
    return chart;
}

std::string to_csv(const std::vector<BodyRows>& bodies) {
    std::string text;
    for (const BodyRows& body : bodies) {
        std::istringstream lines(to_csv(body.rows));
        std::string line;
        std::getline(lines, line);
        if (text.empty()) text = "body," + line + '\n';
        while (std::getline(lines, line)) text += body.body + ',' + line + '\n';
    }
    return text;
}

}  // namespace nbd

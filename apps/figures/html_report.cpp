#include "apps/figures/html_report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "apps/figures/verdict.hpp"
#include "collision/base/file_text.hpp"
#include "meshing/formats/base64.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "training/calibrate/statistics.hpp"

namespace nbd {
namespace {

constexpr std::string_view style =
    "body{font:15px/1.5 system-ui,sans-serif;color:#222;max-width:62rem;margin:2rem auto;padding:0 1rem}"
    "h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2.2rem}"
    "table{border-collapse:collapse;margin:.6rem 0;font-variant-numeric:tabular-nums}"
    "th,td{padding:.15rem .5rem;text-align:right;border-bottom:1px solid #e3e5e8}"
    "th{font-weight:600;color:#555}td:first-child,th:first-child{text-align:left}"
    ".trust{background:#f3f6fa;border-left:4px solid #0073b3;padding:.6rem 1rem}"
    ".wide{overflow-x:auto}img{width:100%;height:auto}"
    "code{background:#f2f3f5;padding:.1rem .3rem;overflow-wrap:anywhere}";

std::string escaped(std::string_view text) {
    std::string result;
    for (const char c : text) {
        if (c == '&')
            result += "&amp;";
        else if (c == '<')
            result += "&lt;";
        else if (c == '>')
            result += "&gt;";
        else if (c == '"')
            result += "&quot;";
        else
            result += c;
    }
    return result;
}

/// Embeds a PNG file. alt: description for readers who cannot see it.
std::string embedded(const std::filesystem::path& path, std::string_view alt) {
    return fmt::format("<img alt=\"{}\" src=\"data:image/png;base64,{}\">\n", escaped(alt),
                       to_base64(file_text(path)));
}

std::string facts(const TreeFile& file, const BodyFigures& figures) {
    const TrainingFacts& facts = file.facts;
    std::string text = "<table>\n";
    const auto tell = [&](std::string_view what, const std::string& value) {
        text += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", what, escaped(value));
    };
    tell("body", facts.body_hash);
    tell("surface", fmt::format("{} vertices, {} faces", file.tree.vertex_count, file.tree.faces.rows()));
    tell("tree",
         fmt::format("{} nodes, {} levels", file.tree.spheres.nodes.size(), file.tree.spheres.depth() + 1));
    tell("trained on",
         fmt::format("{} poses of {} trajectories", facts.poses, facts.split.train_trajectories.size()));
    tell("error of the clustered coordinates", fmt::format("{:.2f} %", 100 * facts.z_error));
    for (const TestSet& set : figures.sets)
        tell("tested on",
             fmt::format("{}: {} poses of {} trajectories", set.name, set.frames, set.trajectories));
    for (const auto& [kind, calibration] : file.tree.calibrations)
        tell("calibrated",
             fmt::format(
                 "{} bounds: at most {:g} % of the nodes of a depth miss, in {:g} % of the trajectories "
                 "on average over calibration sets. This set, of {} poses of {} trajectories, "
                 "gives less than {:.3g} % with 5 % chance.",
                 name(kind), 100 * calibration.miss_rate, 100 * calibration.confidence, calibration.poses,
                 calibration.trajectories,
                 100 * share_kept_but_for(0.05, calibration.trajectories, calibration.confidence)));
    return text + "</table>\n";
}

/// A row of a table. tag: "th" or "td". cells: between bars.
std::string row(const char* tag, std::string_view cells) {
    std::string text = "<tr>";
    for (std::size_t begin = 0; begin <= cells.size();) {
        const std::size_t end = std::min(cells.find('|', begin), cells.size());
        text += fmt::format("<{0}>{1}</{0}>", tag, cells.substr(begin, end - begin));
        begin = end + 1;
    }
    return text + "</tr>\n";
}

/// Table of one bound on one set of frames, one line per depth. rows: of these alone, by margin and depth.
std::string table(const std::vector<EvaluationRow>& rows) {
    constexpr std::array shown{0.0, 0.01, 0.02, 0.05, 0.10, 0.25};
    const auto at = [&](int depth, double margin) {
        return std::ranges::find_if(
            rows, [&](const EvaluationRow& r) { return r.depth == depth && r.margin == margin; });
    };
    std::string heads = "depth|radius|centre";
    for (int i = 0; i < 2; ++i)
        for (const double margin : shown) heads += fmt::format("|{:g} %", 100 * margin);
    std::string text = "<div class=\"wide\"><table>\n<tr><th></th><th colspan=\"2\">error, %</th>";
    for (const char* what : {"vertices outside, %, at a margin of", "nodes that miss, %, at a margin of"})
        text += fmt::format("<th colspan=\"{}\">{}</th>", shown.size(), what);
    text += "</tr>\n" + row("th", heads);
    for (int depth = 0; at(depth, 0) != rows.end(); ++depth) {
        std::string cells = fmt::format("{}|{:.2f}|{:.2f}", depth, 100 * at(depth, 0)->radius_error,
                                        100 * at(depth, 0)->centre_error);
        for (const double margin : shown)
            cells += fmt::format("|{:.4f}", 100 * at(depth, margin)->vertices_outside);
        for (const double margin : shown)
            cells += fmt::format("|{:.2f}", 100 * at(depth, margin)->nodes_missing);
        text += row("td", cells);
    }
    return text + "</table></div>\n";
}

std::string as_calibrated(const std::vector<CoverageRow>& coverage) {
    if (coverage.empty()) return "";
    std::string text = fmt::format(
        "<h2>As calibrated</h2>\n"
        "<p>{} poses of {} trajectories, with the margins and limits that queries use by default.</p>\n"
        "<div class=\"wide\"><table>\n",
        coverage.front().poses, coverage.front().trajectories);
    text +=
        row("th", fmt::format("bound|depth|nodes that miss, %|95 % interval|trajectories that keep {:g} %|"
                              "vertices outside, %|inflation, %|out of range, %",
                              100 * coverage.front().miss_rate));
    for (const CoverageRow& r : coverage)
        text += row("td",
                    fmt::format("{}|{}|{:.3f}|{:.3f} to {:.3f}|{} of {}|{:.5f}|{:.2f}|{:.2f}", name(r.bound),
                                r.depth, 100 * r.nodes_missing, 100 * r.nodes_missing_mean.low,
                                100 * r.nodes_missing_mean.high, r.keeping, r.trajectories,
                                100 * r.vertices_outside, 100 * r.inflation, 100 * r.out_of_range));
    return text + "</table></div>\n";
}

std::string tables(const std::vector<EvaluationRow>& rows) {
    std::string text;
    for (auto begin = rows.begin(); begin != rows.end();) {
        const auto end = std::find_if(begin, rows.end(), [&](const EvaluationRow& r) {
            return r.frames != begin->frames || r.bound != begin->bound;
        });
        text += fmt::format("<h3>{} bounds, {}, {} poses</h3>\n", name(begin->bound), escaped(begin->frames),
                            begin->poses);
        text += table({begin, end});
        begin = end;
    }
    return text;
}

}  // namespace

std::string html_report(const TreeFile& file, const BodyFigures& figures,
                        const std::vector<CoverageRow>& coverage, const std::string& command) {
    const h5::ScratchFolder scratch;
    const std::filesystem::path& charts = scratch.path();
    write_table_and_charts(charts, {figures.rows});
    std::string html = fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title>\n"
        "<style>{1}</style></head><body>\n<h1>{0}: bounds of a collision tree</h1>\n<div class=\"trust\">\n",
        escaped(figures.rows.body), style);
    for (const auto& sentences : {verdicts(coverage), verdicts(figures.rows.rows)})
        for (const std::string& sentence : sentences) html += fmt::format("<p>{}</p>\n", escaped(sentence));
    html +=
        "<p>Nothing has been measured on poses unlike these: "
        "another material, stronger deformation, other kinds of motion.</p>\n"
        "</div>\n<h2>What was tested</h2>\n";
    html += facts(file, figures);
    html += "<h2>By depth</h2>\n" + embedded(charts / "figure6.png", "vertices outside by depth") +
            embedded(charts / "figure7.png", "radius error by depth");
    html += "<h2>By margin</h2>\n" +
            embedded(charts / fmt::format("figure8_{}.png", figures.rows.body), "vertices outside by margin");
    html += as_calibrated(coverage);
    html +=
        "<h2>Tables</h2>\n<p>Means over the nodes of a depth; errors relative to the exact radius.</p>\n" +
        tables(figures.rows.rows);
    html += fmt::format("<p>Made by <code>{}</code></p>\n</body></html>\n", escaped(command));
    return html;
}

}  // namespace nbd

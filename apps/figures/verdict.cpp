#include "apps/figures/verdict.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace nbd {
namespace {

constexpr double trusted = 1e-3;  // share of nodes that miss

/// One margin of a bound, over all depths.
struct AtMargin {
    double margin = 0, missing = 0, mean_error = 0;  // missing: at the worst depth; mean_error: over depths
    int depth = 0;                                   // the worst depth
    long nodes = 0;
};

std::vector<AtMargin> by_margin(const std::vector<EvaluationRow>& rows, BoundKind kind) {
    std::vector<AtMargin> result;
    int depths = 0;
    for (const EvaluationRow& row : rows) {
        if (row.frames != rows.back().frames || row.bound != kind) continue;
        if (result.empty() || result.back().margin != row.margin) {
            result.push_back({.margin = row.margin});
            depths = 0;
        }
        AtMargin& at = result.back();
        if (row.nodes_missing > at.missing) {
            at.missing = row.nodes_missing;
            at.depth = row.depth;
        }
        at.mean_error += (row.radius_error - at.mean_error) / ++depths;
        at.nodes += row.nodes;
    }
    return result;
}

/// Writes a share > 0: "58 % of the nodes", "one node in 1200".
std::string nodes(double share) {
    if (share >= 0.05) return fmt::format("{:.0f} % of the nodes", 100 * share);
    const double n = 1 / share;
    const double step = std::pow(10, std::max(0.0, std::floor(std::log10(n)) - 1));
    return fmt::format("one node in {:.0f}", step * std::floor(n / step));
}

std::string verdict(const std::vector<AtMargin>& at, const std::string& frames, std::string_view bound) {
    const std::string where = fmt::format("On these poses ({}) {} bounds", frames, bound);
    if (at.front().missing == 0)
        return fmt::format("{} contained every vertex in all {} spheres; the mean radius error is {:.1f} %.",
                           where, at.front().nodes, 100 * at.front().mean_error);
    const std::string as_they_are =
        fmt::format("{} without a margin leave a part of {} outside at the worst depth ({})", where,
                    nodes(at.front().missing), at.front().depth);
    const auto enough = std::ranges::find_if(at, [](const AtMargin& a) { return a.missing <= trusted; });
    if (enough == at.end())
        return fmt::format(
            "{}, and of {} even with {:.0f} % added to every radius. "
            "Use exact bounds where a missed contact matters.",
            as_they_are, nodes(at.back().missing), 100 * at.back().margin);
    const std::string margins = "they miss at most one node in a thousand on poses like these";
    if (enough == at.begin()) return fmt::format("{}: {}.", as_they_are, margins);
    return fmt::format("{}; with {:.0f} % added to every radius {}, with a mean radius error of {:.1f} %.",
                       as_they_are, 100 * enough->margin, margins, 100 * enough->mean_error);
}

}  // namespace

std::vector<std::string> verdicts(const std::vector<EvaluationRow>& rows) {
    std::vector<BoundKind> seen;
    std::vector<std::string> sentences;
    for (const EvaluationRow& row : rows) {
        if (row.bound == BoundKind::exact || std::ranges::find(seen, row.bound) != seen.end()) continue;
        seen.push_back(row.bound);
        sentences.push_back(verdict(by_margin(rows, row.bound), rows.back().frames, name(row.bound)));
    }
    return sentences;
}

std::vector<std::string> verdicts(const std::vector<CoverageRow>& coverage) {
    std::vector<std::string> sentences;
    for (auto begin = coverage.begin(); begin != coverage.end();) {
        const auto end = std::find_if(begin, coverage.end(),
                                      [&](const CoverageRow& row) { return row.bound != begin->bound; });
        const auto worst = std::max_element(begin, end, [](const CoverageRow& a, const CoverageRow& b) {
            return a.nodes_missing < b.nodes_missing;
        });
        double inflation = 0, out_of_range = 0;
        for (auto row = begin; row != end; ++row) {
            inflation += row->inflation / static_cast<double>(end - begin);
            out_of_range += row->out_of_range / static_cast<double>(end - begin);
        }
        sentences.push_back(
            fmt::format("With calibrated margins, {} bounds missed {:.2g} % of the nodes at the worst depth "
                        "({}). The stated miss rate of {:g} % is to hold in {:.3g} % of the trajectories and "
                        "held in {} of {}. Radii are {:.1f} % larger than the exact ones on average, and "
                        "{:.1f} % of the nodes were out of range and bounded exactly.",
                        name(begin->bound), 100 * worst->nodes_missing, worst->depth, 100 * worst->miss_rate,
                        100 * worst->confidence, worst->keeping, worst->trajectories, 100 * inflation,
                        100 * out_of_range));
        begin = end;
    }
    return sentences;
}

}  // namespace nbd

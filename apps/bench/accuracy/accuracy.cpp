#include "apps/bench/accuracy/accuracy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace nbd {
namespace {

/// Percentages of a number over rows, as "1.2 to 3.4".
template <class Number>
std::string extent(std::span<const Accuracy> rows, const Number& number) {
    double least = std::numeric_limits<double>::infinity(), largest = -least;
    for (const Accuracy& row : rows) {
        least = std::min(least, 100 * number(row));
        largest = std::max(largest, 100 * number(row));
    }
    return fmt::format("{:.3g} to {:.3g}", least, largest);
}

}  // namespace

std::vector<Accuracy> measure_accuracy(const TreeFile& file, const RecordingReader& recording,
                                       std::span<const BoundKind> bounds) {
    const SurfaceBody body = surface_body(file);
    const auto tree = refer_to(file.tree);
    std::vector<Accuracy> rows;
    for (const TestFrames& set : test_frames(file, recording))
        for (const BoundKind kind : bounds) {
            std::vector<CoverageRow> calibrated;
            if (tree->calibrations.contains(kind))
                calibrated = measure_coverage(body, tree, kind, recording, set.frames);
            for (const EvaluationRow& bare : evaluate_frames(body, tree, recording, set.frames, set.name,
                                                             {.bounds = {kind}, .margins = {0}})) {
                Accuracy& row = rows.emplace_back(Accuracy{bare, {}});
                if (!calibrated.empty()) row.calibrated = calibrated[static_cast<std::size_t>(bare.depth)];
            }
        }
    return rows;
}

std::string accuracy_cells(const Accuracy& accuracy) {
    const EvaluationRow& bare = accuracy.bare;
    std::string cells =
        fmt::format("{},{},{},{},{:.4g},{:.4g},{:.4g},{:.4g},", name(bare.bound), bare.frames, bare.poses,
                    bare.depth, bare.radius_error, bare.inflation, bare.vertices_outside, bare.nodes_missing);
    if (!accuracy.calibrated) return cells + ",,,,";
    const CoverageRow& row = *accuracy.calibrated;
    return cells + fmt::format("{:.4g},{:.4g},{:.4g},{},{}", row.inflation, row.nodes_missing,
                               row.out_of_range, row.keeping, row.trajectories);
}

std::string to_text(const std::vector<Accuracy>& rows, std::string_view indent) {
    std::string text;
    const auto other_block = [](const Accuracy& a, const Accuracy& b) {
        return a.bare.frames != b.bare.frames || a.bare.bound != b.bare.bound;
    };
    for (auto begin = rows.begin(), end = begin; begin != rows.end(); begin = end) {
        end = std::find_if(begin, rows.end(), [&](const Accuracy& row) { return other_block(*begin, row); });
        const std::span<const Accuracy> depths(begin, end);
        const auto of = [&](auto number) { return extent(depths, number); };
        text += fmt::format("{}{}{:15} {:21} radius error {} %, inflation {} %", text.empty() ? "" : "\n",
                            indent, name(begin->bare.bound), begin->bare.frames,
                            of([](const Accuracy& a) { return a.bare.radius_error; }),
                            of([](const Accuracy& a) { return a.bare.inflation; }));
        if (begin->calibrated)
            text += fmt::format("; calibrated {} %, nodes that miss {} %",
                                of([](const Accuracy& a) { return a.calibrated->inflation; }),
                                of([](const Accuracy& a) { return a.calibrated->nodes_missing; }));
    }
    return text;
}

nlohmann::ordered_json to_json(const Accuracy& accuracy) {
    const EvaluationRow& bare = accuracy.bare;
    nlohmann::ordered_json json = {{"bound", name(bare.bound)},
                                   {"frames", bare.frames},
                                   {"poses", bare.poses},
                                   {"depth", bare.depth},
                                   {"radius_error", bare.radius_error},
                                   {"inflation", bare.inflation},
                                   {"vertices_outside", bare.vertices_outside},
                                   {"nodes_missing", bare.nodes_missing}};
    const std::optional<CoverageRow>& row = accuracy.calibrated;
    const auto cell = [&](const char* key, auto number) {
        json[key] = row ? nlohmann::ordered_json(number(*row)) : nlohmann::ordered_json();
    };
    cell("calibrated_inflation", [](const CoverageRow& r) { return r.inflation; });
    cell("calibrated_nodes_missing", [](const CoverageRow& r) { return r.nodes_missing; });
    cell("out_of_range", [](const CoverageRow& r) { return r.out_of_range; });
    cell("trajectories_keeping", [](const CoverageRow& r) { return r.keeping; });
    cell("trajectories", [](const CoverageRow& r) { return r.trajectories; });
    return json;
}

}  // namespace nbd

#include "apps/bench/accuracy/accuracy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <ranges>

namespace nbd {
namespace {

template <class Number>
Extent extent(std::span<const Accuracy> rows, const Number& number) {
    const auto [least, largest] = std::ranges::minmax(rows | std::views::transform(number));
    return {least, largest};
}

std::string percent(const Extent& extent) {
    return fmt::format("{:.3g} to {:.3g} %", 100 * extent.least, 100 * extent.largest);
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

std::vector<AccuracyExtents> over_depths(const std::vector<Accuracy>& rows) {
    std::vector<AccuracyExtents> all;
    for (auto begin = rows.begin(), end = begin; begin != rows.end(); begin = end) {
        const EvaluationRow& first = begin->bare;
        end = std::find_if(begin, rows.end(), [&](const Accuracy& row) {
            return row.bare.frames != first.frames || row.bare.bound != first.bound;
        });
        const std::span<const Accuracy> depths(begin, end);
        AccuracyExtents& extents = all.emplace_back(
            AccuracyExtents{.bound = first.bound, .frames = first.frames, .poses = first.poses});
        extents.radius_error = extent(depths, [](const Accuracy& a) { return a.bare.radius_error; });
        extents.inflation = extent(depths, [](const Accuracy& a) { return a.bare.inflation; });
        extents.calibrated = begin->calibrated.has_value();
        if (!extents.calibrated) continue;
        extents.calibrated_inflation =
            extent(depths, [](const Accuracy& a) { return a.calibrated->inflation; });
        extents.calibrated_nodes_missing =
            extent(depths, [](const Accuracy& a) { return a.calibrated->nodes_missing; });
    }
    return all;
}

std::string extents_cells(const AccuracyExtents& e) {
    const std::string cells =
        fmt::format("{},{},{},{:.4g},{:.4g},{:.4g},{:.4g},", name(e.bound), e.frames, e.poses,
                    e.radius_error.least, e.radius_error.largest, e.inflation.least, e.inflation.largest);
    if (!e.calibrated) return cells + ",,";
    return cells + fmt::format("{:.4g},{:.4g},{:.4g}", e.calibrated_inflation.least,
                               e.calibrated_inflation.largest, e.calibrated_nodes_missing.largest);
}

std::string to_text(const std::vector<Accuracy>& rows) {
    std::string text;
    for (const AccuracyExtents& e : over_depths(rows)) {
        text += fmt::format("{}  {:15} {:21} radius error {}, inflation {}", text.empty() ? "" : "\n",
                            name(e.bound), e.frames, percent(e.radius_error), percent(e.inflation));
        if (e.calibrated)
            text += fmt::format("; calibrated: inflation {}, nodes that miss {}",
                                percent(e.calibrated_inflation), percent(e.calibrated_nodes_missing));
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

#include "apps/bench/pairs/race_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/bench/measure/machine.hpp"
#include "apps/drawing/chart.hpp"

namespace nbd {
namespace {

/// Total time of the fastest exact method on the same surface that reads the same positions.
double best_exact(std::span<const RaceRow> rows, const RaceRow& like) {
    double best = INFINITY;
    for (const RaceRow& row : rows)
        if (row.faces == like.faces && row.reads_nodes == like.reads_nodes && row.exact && row.answers &&
            row.failure.empty())
            best = std::min(best, row.total_us);
    return best;
}

/// Index of a value in the list; appends the value if it is new.
template <class T>
std::size_t add_once(std::vector<T>& list, const T& value) {
    const auto found = std::ranges::find(list, value);
    const auto at = static_cast<std::size_t>(found - list.begin());
    if (found == list.end()) list.push_back(value);
    return at;
}

std::string share_found(const RaceRow& row) {
    return row.answers ? fmt::format("{:.4f}", 100 * row.recall()) : std::string("-");
}

std::string stated(const RaceRow& row) {
    return row.stated_miss_rate ? fmt::format("{:g}", *row.stated_miss_rate) : std::string();
}

}  // namespace

std::string to_csv(std::span<const RaceTable> tables) {
    std::string text = fmt::format(
        "# {}, one thread\n"
        "contact,order,faces,method,exact,reads,scenes,rounds,update_us,query_us,total_us,mean_us,p95_us,"
        "pairs,"
        "missed,invented,recall,stated_miss_rate,bytes,failure\n",
        this_machine());
    for (const RaceTable& table : tables)
        for (const RaceRow& r : table.rows)
            text += fmt::format(
                "{},{},{},{},{},{},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.6g},{},{},{:.8g},{},{},{}\n",
                table.contact, table.order, r.faces, r.method, r.exact ? 1 : 0,
                r.reads_nodes ? "nodes" : "surface", r.scenes, r.rounds, r.update_us, r.query_us, r.total_us,
                r.mean_us, r.p95_us, r.pairs, r.missed, r.invented, r.recall(), stated(r), r.bytes,
                r.failure);
    return text;
}

std::string to_text(const RaceTable& table) {
    std::vector<RaceRow> rows = table.rows;
    std::ranges::stable_sort(rows, {}, [](const RaceRow& r) { return std::pair(r.faces, r.total_us); });
    std::string text = fmt::format(
        "{} contact, vertices in {} order, {} scenes; both bodies, medians in us, then the total's mean\n"
        "     faces  method                         update      query      total  / best exact"
        "       mean        p95    pairs   found %  invented\n",
        table.contact, table.order, rows.empty() ? 0 : rows.front().scenes);
    for (const RaceRow& r : rows) {
        if (!r.failure.empty()) {
            text += fmt::format("  {:8}  {:<27} {}\n", r.faces, r.method, r.failure);
            continue;
        }
        const double best = best_exact(rows, r);
        const std::string ratio = std::isfinite(best) ? fmt::format("{:.2f}", r.total_us / best) : "-";
        text += fmt::format(
            "  {:8}  {:<27} {:9.1f}  {:9.1f}  {:9.1f}  {:>12}  {:9.1f}  {:9.1f}  {:7.1f}  {:>8}  "
            "{:8}\n",
            r.faces, r.method, r.update_us, r.query_us, r.total_us, ratio, r.mean_us, r.p95_us, r.pairs,
            share_found(r), r.invented);
    }
    return text;
}

Page to_page(std::span<const RaceTable> tables) {
    Chart chart{.title = "Intersecting faces of two deforming bodies, one thread",
                .x_label = "faces of each body",
                .y_label = "update and query of both bodies, us",
                .x_ticks = {},
                .panels = {},
                .log_x = true};
    std::vector<std::string> names;
    for (const RaceTable& table : tables) {
        Panel panel{fmt::format("{} contact, {} order", table.contact, table.order), {}};
        for (const RaceRow& r : table.rows) {
            add_once(chart.x_ticks, static_cast<double>(r.faces));
            if (!r.failure.empty()) continue;
            const std::size_t i = add_once(names, r.method);
            auto series = std::ranges::find(panel.series, r.method, &Series::label);
            if (series == panel.series.end()) {
                const int category = static_cast<int>(i);
                panel.series.push_back({r.method, category_colour(category), category_dash(category), {}});
                series = panel.series.end() - 1;
            }
            series->points.push_back({static_cast<double>(r.faces), r.total_us});
        }
        chart.panels.push_back(std::move(panel));
    }
    std::ranges::sort(chart.x_ticks);
    return to_page(chart);
}

Page figure5(std::span<const RaceRow> rows) {
    Chart chart{.title = "Figure 5: time per frame, two bodies, one thread",
                .x_label = "faces of each body",
                .y_label = "us",
                .x_ticks = {},
                .panels = {},
                .columns = 3,
                .log_x = true};
    std::vector<std::string> names;
    for (const RaceRow& r : rows) {
        add_once(names, r.method);
        add_once(chart.x_ticks, static_cast<double>(r.faces));
    }
    std::ranges::sort(chart.x_ticks);
    const std::pair<const char*, double RaceRow::*> parts[] = {
        {"total", &RaceRow::total_us}, {"update", &RaceRow::update_us}, {"collision", &RaceRow::query_us}};
    for (const auto& [part, time] : parts) {
        Panel panel{part, {}};
        for (int i = 0; const std::string& name : names) {
            Series series{name, category_colour(i), category_dash(i), {}};
            for (const RaceRow& r : rows)
                if (r.method == name && r.failure.empty())
                    series.points.push_back({static_cast<double>(r.faces), r.*time});
            panel.series.push_back(std::move(series));
            ++i;
        }
        chart.panels.push_back(std::move(panel));
    }
    return to_page(chart);
}

}  // namespace nbd

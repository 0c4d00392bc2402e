#include "apps/bench/pairs/race_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "apps/bench/machine.hpp"
#include "apps/figures/chart.hpp"

namespace nbd {
namespace {

/// Total of the fastest exact method of others that reads the surface: what learned bounds are to beat.
double best_exact(std::span<const RaceRow> rows, int faces) {
    double best = INFINITY;
    for (const RaceRow& row : rows)
        if (row.faces == faces && row.exact && row.answers && !row.reads_nodes && row.failure.empty())
            best = std::min(best, row.total_us);
    return best;
}

std::string share_found(const RaceRow& row) {
    return row.answers ? fmt::format("{:.4f}", 100 * row.recall()) : std::string("-");
}

}  // namespace

std::string to_csv(std::span<const RaceTable> tables) {
    std::string text = fmt::format(
        "# {}, one thread\n"
        "contact,order,faces,method,exact,reads,scenes,rounds,update_us,query_us,total_us,pairs,missed,"
        "invented,"
        "recall,bytes,failure\n",
        this_machine());
    for (const RaceTable& table : tables)
        for (const RaceRow& r : table.rows)
            text +=
                fmt::format("{},{},{},{},{},{},{},{},{:.3f},{:.3f},{:.3f},{:.6g},{},{},{:.8g},{},{}\n",
                            table.contact, table.order, r.faces, r.method, r.exact ? 1 : 0,
                            r.reads_nodes ? "nodes" : "surface", r.scenes, r.rounds, r.update_us, r.query_us,
                            r.total_us, r.pairs, r.missed, r.invented, r.recall(), r.bytes, r.failure);
    return text;
}

std::string to_text(const RaceTable& table) {
    std::vector<RaceRow> rows = table.rows;
    std::ranges::stable_sort(rows, {}, [](const RaceRow& r) { return std::pair(r.faces, r.total_us); });
    std::string text = fmt::format(
        "{} contact, vertices in {} order; both bodies, us\n"
        "     faces  method                  update      query      total  / best exact"
        "    pairs  found %  invented\n",
        table.contact, table.order);
    for (const RaceRow& r : rows)
        if (r.failure.empty())
            text += fmt::format("  {:8}  {:<20} {:9.1f}  {:9.1f}  {:9.1f}  {:12.2f}  {:7.1f}  {:>7}  {:8}\n",
                                r.faces, r.method, r.update_us, r.query_us, r.total_us,
                                r.total_us / best_exact(rows, r.faces), r.pairs, share_found(r), r.invented);
        else
            text += fmt::format("  {:8}  {:<20} {}\n", r.faces, r.method, r.failure);
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
        std::map<std::string, std::vector<PagePoint>> lines;
        for (const RaceRow& r : table.rows) {
            if (std::ranges::find(names, r.method) == names.end()) names.push_back(r.method);
            if (std::ranges::find(chart.x_ticks, r.faces) == chart.x_ticks.end())
                chart.x_ticks.push_back(r.faces);
            if (r.failure.empty()) lines[r.method].push_back({static_cast<double>(r.faces), r.total_us});
        }
        for (auto& [name, points] : lines) {
            std::ranges::sort(points, {}, &PagePoint::x);
            const auto i = static_cast<int>(std::ranges::find(names, name) - names.begin());
            constexpr Dash dashes[] = {Dash::solid, Dash::dashed, Dash::dotted};
            panel.series.push_back({name, category_colour(i), dashes[i / 7 % 3], std::move(points)});
        }
        std::ranges::sort(panel.series, {},
                          [&](const Series& s) { return std::ranges::find(names, s.label); });
        chart.panels.push_back(std::move(panel));
    }
    std::ranges::sort(chart.x_ticks);
    return to_page(chart);
}

}  // namespace nbd

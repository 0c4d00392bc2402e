#include "apps/bench/pairs/race_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/bench/measure/machine.hpp"

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
        "pairs,missed,invented,recall,stated_miss_rate,bytes,failure\n",
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
            "  {:8}  {:<27} {:9.1f}  {:9.1f}  {:9.1f}  {:>12}  {:9.1f}  {:9.1f}  {:7.1f}  {:>8}  {:8}\n",
            r.faces, r.method, r.update_us, r.query_us, r.total_us, ratio, r.mean_us, r.p95_us, r.pairs,
            share_found(r), r.invented);
    }
    return text;
}

}  // namespace nbd

#include "apps/bench/threads/thread_table.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <limits>
#include <map>

#include "apps/bench/measure/measure.hpp"

namespace nbd {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t at_16 = 3;  // in counted_threads
static_assert(counted_threads[at_16] == 16);
constexpr int shown_places = 12;

std::string key(int threads) {
    return threads == std::numeric_limits<int>::max() ? "ms_unlimited" : fmt::format("ms_{}", threads);
}

void add_times(ThreadTimes& sum, const ThreadTimes& times) {
    for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += times[k];
}

Json row_of(const std::string& work, const char* kind, const WorkPlace& place, int steps) {
    Json row{{"work", work}, {"kind", kind}, {"phase", place.phase}, {"place", place.place}};
    row["loops"] = static_cast<double>(place.loops) / steps;
    row["tasks"] = static_cast<double>(place.tasks) / steps;
    for (std::size_t k = 0; k < counted_threads.size(); ++k)
        row[key(counted_threads[k])] = 1e3 * place.seconds[k] / steps;
    return row;
}

template <class Mean>
Json measured_row(const std::string& work, const char* kind, const std::vector<MeasuredTimes>& measured,
                  const Mean& mean_of) {
    Json row{{"work", work},     {"kind", kind},     {"phase", nullptr},
             {"place", nullptr}, {"loops", nullptr}, {"tasks", nullptr}};
    for (const int threads : counted_threads) row[key(threads)] = nullptr;
    for (const MeasuredTimes& times : measured) row[key(times.threads)] = 1e3 * mean_of(times.seconds);
    return row;
}

/// ms_1 of the row over that of other threads; null where there is none.
Json gains_of(const Json& row, const std::string& name) {
    Json gains{{"times faster", name}};
    for (const int threads : counted_threads) {
        const Json &one = row[key(1)], &more = row[key(threads)];
        const std::string column = key(threads).substr(3);
        if (one.is_null() || more.is_null() || more == 0.0)
            gains[column] = nullptr;
        else
            gains[column] = one.get<double>() / more.get<double>();
    }
    return gains;
}

}  // namespace

std::vector<int> threads_here() {
    const auto most = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    std::vector<int> threads;
    for (const int count : counted_threads)
        if (static_cast<std::size_t>(count) <= most) threads.push_back(count);
    return threads;
}

Rows thread_rows(const std::string& work, const WorkCount& count, int steps,
                 const std::vector<MeasuredTimes>& measured) {
    WorkPlace all;
    std::map<std::string, WorkPlace> phases;
    std::vector<WorkPlace> places = count.places();
    for (const WorkPlace& place : places)
        for (WorkPlace* sum : {&all, &phases[place.phase]}) {
            sum->loops += place.loops;
            sum->tasks += place.tasks;
            add_times(sum->seconds, place.seconds);
        }
    Rows rows{row_of(work, "counted", all, steps), measured_row(work, "measured", measured, mean),
              measured_row(work, "median", measured, median)};
    for (auto& [phase, sum] : phases) {
        sum.phase = phase;
        rows.push_back(row_of(work, "phase", sum, steps));
    }
    std::ranges::stable_sort(
        places, [](const WorkPlace& a, const WorkPlace& b) { return a.seconds[at_16] > b.seconds[at_16]; });
    for (const WorkPlace& place : places)
        rows.push_back(row_of(work, place.is_loop ? "loop" : "serial", place, steps));
    return rows;
}

std::string thread_text(const Rows& rows) {
    const double one = rows.at(0)[key(1)], sixteen = rows.at(0)[key(16)];
    Rows gains{gains_of(rows[0], "as counted"), gains_of(rows.at(1), "as measured"),
               gains_of(rows.at(2), "medians")};
    std::vector<std::string> columns{"times faster"};
    for (const int threads : counted_threads) columns.push_back(key(threads).substr(3));
    std::string text = to_text(gains, columns) + "\n";
    for (std::size_t k = 1; k < counted_threads.size(); ++k) {
        const std::string name = key(counted_threads[k]);
        if (rows[1][name].is_null() || rows[1][name] == 0.0) continue;
        const double counted = rows[0][name], found = rows[1][name];
        text += fmt::format("on {} threads the count is off by {:+.0f} %\n", counted_threads[k],
                            100 * (counted / found * rows[1][key(1)].get<double>() / one - 1));
    }
    Rows parts;
    int places = 0;
    for (const Json& row : rows) {
        const std::string kind = row["kind"];
        const bool is_place = kind == "loop" || kind == "serial";
        if (kind != "phase" && !is_place) continue;
        if (is_place && ++places > shown_places) break;
        const std::string place = row["place"];
        parts.push_back(
            {{"part", kind},
             {"phase", row["phase"]},
             {"where", kind == "serial" ? (place.empty() ? "at its start" : "after " + place) : place},
             {"loops", row["loops"]},
             {"tasks", row["tasks"]},
             {"ms on 1", row[key(1)]},
             {"on 16", row[key(16)]},
             {"% of 1", 100 * row[key(1)].get<double>() / one},
             {"% of 16", 100 * row[key(16)].get<double>() / sixteen}});
    }
    return text + to_text(parts, {"part", "phase", "where", "loops", "tasks", "ms on 1", "on 16", "% of 1",
                                  "% of 16"});
}

}  // namespace nbd

#include "apps/bench/physics/physics_run.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <ctime>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>

#include "sim/factor/blas.hpp"

namespace nbd {
namespace {

/// Processor time of the calling thread, seconds.
double thread_seconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

void run_case(const PhysicsCheck& check, PhysicsRow& row) {
    const double start = thread_seconds();
    try {
        row.found = check.run(row.at);
        if (std::isnan(row.found.error)) row.found.error = std::numeric_limits<double>::infinity();
    } catch (const std::exception& failure) {
        const double none = std::numeric_limits<double>::quiet_NaN();
        row.found = {.value = none,
                     .truth = none,
                     .error = std::numeric_limits<double>::infinity(),
                     .note = failure.what()};
    }
    row.seconds = thread_seconds() - start;
}

}  // namespace

const PhysicsRow& PhysicsResult::worst() const {
    return *std::ranges::max_element(rows, {}, [](const PhysicsRow& row) { return row.found.error; });
}

int PhysicsResult::failed() const {
    return std::ranges::count_if(rows,
                                 [&](const PhysicsRow& row) { return !(row.found.error <= check.allowed); });
}

double PhysicsResult::seconds() const {
    double sum = 0;
    for (const PhysicsRow& row : rows) sum += row.seconds;
    return sum;
}

std::vector<PhysicsResult> run_physics(const std::vector<PhysicsCheck>& checks, bool quick, Output& out) {
    hold_blas_to_one_thread();
    std::vector<PhysicsResult> results;
    for (const PhysicsCheck& check : checks) {
        PhysicsResult result{.check = check, .rows = {}};
        std::erase_if(result.check.cases, [&](const PhysicsCase& c) { return quick && !c.quick; });
        for (const PhysicsCase& c : result.check.cases) result.rows.push_back({.at = c, .found = {}});
        if (!result.rows.empty()) results.push_back(std::move(result));
    }
    struct Task {
        const PhysicsCheck* check;
        PhysicsRow* row;
    };
    std::vector<Task> tasks;
    for (PhysicsResult& result : results)
        for (PhysicsRow& row : result.rows) tasks.push_back({&result.check, &row});

    std::atomic<std::size_t> next{0}, done{0};
    std::mutex telling;
    const auto work = [&] {
        tbb::task_arena alone(1);
        for (std::size_t t = next++; t < tasks.size(); t = next++) {
            const SerialOpenMP serial;
            alone.execute([&] { run_case(*tasks[t].check, *tasks[t].row); });
            const std::lock_guard lock(telling);
            out.progress(tasks[t].check->name, static_cast<double>(++done),
                         static_cast<double>(tasks.size()));
        }
    };
    const std::size_t threads = std::min(
        tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism), tasks.size());
    std::vector<std::jthread> workers;
    for (std::size_t k = 0; k < threads; ++k) workers.emplace_back(work);
    workers.clear();
    return results;
}

namespace {

std::string number(double value) { return std::isnan(value) ? "-" : fmt::format("{:.3g}", value); }

}  // namespace

std::string describe(const PhysicsCheck& check, const PhysicsCase& at) {
    std::string text = fmt::format("size {:g} m, dt {:g} ms, {:g} Pa", at.size, 1e3 * at.dt, at.young);
    if (!std::isnan(at.parameter)) text += fmt::format(", {} {:g}", check.parameter, at.parameter);
    if (!at.variant.empty()) text += ", " + at.variant;
    if (at.far_body) text += ", a far body";
    return text;
}

std::string physics_table(std::span<const PhysicsResult> results) {
    std::string table =
        "| check | truth | worst case | found | truth there | error | allowed | held | cases that fail |\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
    for (const PhysicsResult& result : results) {
        const PhysicsRow& worst = result.worst();
        table +=
            fmt::format("| `{}` | {} | {}{}{} | {} | {} | {} | {} | {} | {} of {} |\n", result.check.name,
                        result.check.truth, describe(result.check, worst.at),
                        worst.found.note.empty() ? "" : ": ", worst.found.note, number(worst.found.value),
                        number(worst.found.truth), number(worst.found.error), number(result.check.allowed),
                        result.held() ? "yes" : "**no**", result.failed(), result.rows.size());
    }
    if (!table.empty()) table.pop_back();
    return table;
}

Rows physics_rows(std::span<const PhysicsResult> results) {
    Rows rows;
    for (const PhysicsResult& result : results)
        for (const PhysicsRow& row : result.rows) {
            const PhysicsCheck& check = result.check;
            rows.push_back({{"check", check.name},
                            {"section", check.section},
                            {"size_m", row.at.size},
                            {"dt_s", row.at.dt},
                            {"young_pa", row.at.young},
                            {"far_body", row.at.far_body},
                            {"variant", row.at.variant},
                            {"parameter", nullptr},
                            {"quantity", check.quantity},
                            {"value", row.found.value},
                            {"truth", row.found.truth},
                            {"error", row.found.error},
                            {"allowed", check.allowed},
                            {"held", row.found.error <= check.allowed},
                            {"seconds", row.seconds},
                            {"note", row.found.note}});
            if (!std::isnan(row.at.parameter)) rows.back()["parameter"] = row.at.parameter;
        }
    return rows;
}

}  // namespace nbd

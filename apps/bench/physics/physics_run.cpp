#include "apps/bench/physics/physics_run.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <ctime>
#include <exception>
#include <fstream>
#include <limits>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "apps/bench/measure/measure.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "sim/factor/blas.hpp"

namespace nbd {
namespace {

/// Processor time of the calling thread, seconds.
double thread_seconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
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

std::string number(double value, const char* none = "-") {
    if (std::isnan(value)) return none;
    return fmt::format("{:.3g}", value);
}

const char* mode(const PhysicsCase& at) { return at.intersection_free ? "free" : "default"; }

constexpr const char* header = "check,failed,error";

/// Whether the text is one number and nothing else.
template <class Number>
bool reads(const std::string& text, Number& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && !text.empty();
}

/// For a cell of CSV.
std::string quoted(const std::string& text) {
    std::string result = "\"";
    for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
    return result + '"';
}

}  // namespace

std::string describe(const PhysicsCheck& check, const PhysicsCase& at) {
    std::string text =
        fmt::format("size {:g} m, dt {:g} ms, {:g} Pa, {}", at.size, 1e3 * at.dt, at.young, mode(at));
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

void write_physics_cases(const std::filesystem::path& path, std::span<const PhysicsResult> results) {
    h5::AtomicFile file(path);
    file.out() << "# " << this_machine() << '\n'
               << "check,section,size_m,dt_s,young_pa,mode,far_body,variant,parameter,quantity,value,truth,"
                  "error,allowed,held,seconds,note\n";
    for (const PhysicsResult& result : results)
        for (const PhysicsRow& row : result.rows)
            file.out() << fmt::format(
                "{},{},{:g},{:g},{:g},{},{:d},{},{},{},{:.9g},{:.9g},{:.4g},{:g},{:d},"
                "{:.3f},{}\n",
                result.check.name, result.check.section, row.at.size, row.at.dt, row.at.young, mode(row.at),
                row.at.far_body, quoted(row.at.variant), number(row.at.parameter, ""),
                quoted(result.check.quantity), row.found.value, row.found.truth, row.found.error,
                result.check.allowed, row.found.error <= result.check.allowed, row.seconds,
                quoted(row.found.note));
    file.commit();
}

std::vector<KnownFault> read_known_faults(const std::filesystem::path& path) {
    std::ifstream in(path);
    if (!in) throw std::runtime_error(fmt::format("{}: cannot be read", path.string()));
    std::vector<KnownFault> known;
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        if (line.empty() || line.starts_with('#') || line == header) continue;
        KnownFault fault;
        std::istringstream cells(line);
        std::string failed, error;
        std::getline(cells, fault.check, ',');
        std::getline(cells, failed, ',');
        std::getline(cells, error);
        if (!reads(failed, fault.failed) || !reads(error, fault.error))
            throw std::runtime_error(fmt::format(
                "{}: line {} is '{}'; allowed: a check, how many cases fail, and the largest error or `inf`",
                path.string(), number, line));
        known.push_back(std::move(fault));
    }
    return known;
}

void write_known_faults(const std::filesystem::path& path, std::span<const PhysicsResult> results) {
    h5::AtomicFile file(path);
    file.out() << "# checks of `nbdtree-bench physics --quick` that do not hold: how many cases fail, "
                  "and the largest error\n"
               << header << '\n';
    for (const PhysicsResult& result : results)
        if (!result.held())
            file.out() << fmt::format("{},{},{:.3g}\n", result.check.name, result.failed(),
                                      result.worst().found.error);
    file.commit();
}

std::vector<std::string> changes(std::span<const PhysicsResult> results, std::span<const KnownFault> known,
                                 double slack) {
    std::vector<std::string> lines;
    for (const PhysicsResult& result : results) {
        const auto listed = std::ranges::find(known, result.check.name, &KnownFault::check);
        const PhysicsRow& worst = result.worst();
        const std::string where = fmt::format("{}: error {} at {}{}{}", result.check.name,
                                              number(worst.found.error), describe(result.check, worst.at),
                                              worst.found.note.empty() ? "" : ": ", worst.found.note);
        if (listed == known.end()) {
            if (!result.held())
                lines.push_back(fmt::format("{}; allowed: {}", where, number(result.check.allowed)));
        } else if (result.held()) {
            lines.push_back(fmt::format("{} holds now (error {}): strike it from the list", result.check.name,
                                        number(worst.found.error)));
        } else if (worst.found.error > (1 + slack) * listed->error) {
            lines.push_back(fmt::format("{}; listed: {}", where, number(listed->error)));
        } else if (result.failed() > listed->failed) {
            lines.push_back(fmt::format("{}: {} cases fail; listed: {}", result.check.name, result.failed(),
                                        listed->failed));
        }
    }
    return lines;
}

}  // namespace nbd

#include "apps/bench/physics/physics_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "apps/bench/measure/machine.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
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
                "{},{},{:g},{:g},{:g},{},{:d},{},{},{},{:.9g},{:.9g},{:.4g},{:g},{:d},{:.3f},{}\n",
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
    file.out()
        << "# checks of `nbdtree-bench physics --quick` that do not hold: how many cases fail, and the "
           "largest error\n"
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

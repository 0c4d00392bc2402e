#include "apps/simulate/reaction_table.hpp"

#include <fmt/format.h>

#include "sim/scene/reaction_name.hpp"

namespace nbd {
namespace {

/// A text as a cell of CSV.
std::string csv_cell(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
    return quoted + '"';
}

}  // namespace

void ReactionTable::add(const std::vector<StepReactions>& steps) {
    for (const StepReactions& step : steps)
        for (const Reaction& one : step.all) {
            std::string line = fmt::format("{},{:.9g},{},{},{}", step.frame, step.time,
                                           csv_cell(unique_name(spec_, one.body)), name(one.by),
                                           csv_cell(reaction_name(spec_, one)));
            for (const Eigen::Vector3d& vector : {one.force, one.torque})
                for (const double number : vector) line += fmt::format(",{:.9g}", number);
            line +=
                one.by == ReactionBy::cavity ? fmt::format(",{:.9g},{:.9g}", one.pressure, one.volume) : ",,";
            file_.out() << line << '\n';
        }
}

}  // namespace nbd

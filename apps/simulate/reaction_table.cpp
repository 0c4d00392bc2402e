#include "apps/simulate/reaction_table.hpp"

#include <fmt/format.h>

#include <type_traits>

#include "meshing/formats/words.hpp"
#include "sim/scene/reaction_name.hpp"

namespace nbd {
namespace {

/// The cells of a column in a row.
std::string csv_cells(const ReactionColumn& column, const RecordedReaction& row, const SceneSpec& spec) {
    const bool is_there = column.is_in(row);
    return std::visit(
        [&]<class T>(ReactionColumn::Member<T> member) -> std::string {
            const T& value = row.*member;
            if constexpr (std::is_same_v<T, Eigen::Vector3d>)
                return is_there ? fmt::format("{:.9g},{:.9g},{:.9g}", value[0], value[1], value[2]) : ",,";
            else if constexpr (std::is_same_v<T, double>)
                return is_there ? fmt::format("{:.9g}", value) : "";
            else if constexpr (std::is_same_v<T, std::string>)
                return csv_cell(value);
            else
                return member == &RecordedReaction::body ? csv_cell(unique_name(spec, value))
                                                         : fmt::format("{}", value);
        },
        column.value);
}

}  // namespace

std::vector<RecordedReaction> recorded(const SceneSpec& spec, std::span<const StepReactions> steps) {
    std::vector<RecordedReaction> rows;
    for (const StepReactions& step : steps)
        for (const Reaction& one : step.all)
            rows.push_back({.frame = step.frame,
                            .time = step.time,
                            .body = one.body,
                            .kind = name(one.by),
                            .by = reaction_name(spec, one),
                            .force = one.force,
                            .torque = one.torque,
                            .pressure = one.pressure,
                            .volume = one.volume,
                            .point = one.point});
    return rows;
}

std::string ReactionTable::columns() {
    std::string names;
    for (const ReactionColumn& column : reaction_columns) {
        const bool is_vector = std::holds_alternative<ReactionColumn::Member<Eigen::Vector3d>>(column.value);
        for (const char* part : {"_x", "_y", "_z"}) {
            names += fmt::format("{}{}{}", names.empty() ? "" : ",", column.name, is_vector ? part : "");
            if (!is_vector) break;
        }
    }
    return names;
}

void ReactionTable::add(std::span<const RecordedReaction> rows) {
    for (const RecordedReaction& row : rows) {
        std::string line;
        for (const ReactionColumn& column : reaction_columns) {
            if (!line.empty()) line += ',';
            line += csv_cells(column, row, spec_);
        }
        file_.out() << line << '\n';
    }
}

}  // namespace nbd

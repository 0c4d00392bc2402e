#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/dataset/plan.hpp"
#include "training/files/dataset_manifest.hpp"

namespace nbd {

/// Which trajectories a split holds out: those whose recipe has a parameter among `names`, between `from` and
/// `to`, both included, or among the top or bottom share of those that have it.
struct HoldOutRule {
    std::string text;       // PARAMETER=VALUES, as written
    std::string parameter;  // names of the recipe's JSON text, joined by dots
    std::vector<std::string> names{};
    double from = -std::numeric_limits<double>::infinity(), to = std::numeric_limits<double>::infinity();
    std::optional<double> top{}, bottom{};  // shares of the trajectories, in (0, 1)
};

/// Reads "kind=thrown,drop", "velocity=0.5..2", "velocity=2..", "velocity=top:0.2" or "velocity=bottom:0.2".
/// Throws std::invalid_argument, one line.
HoldOutRule parse_hold_out(const std::string& text);

/// The value of a parameter in the JSON text of a recipe: a text, or a number, of a vector or matrix its
/// norm, of a list of objects the largest of theirs. nullopt where the recipe does not have it.
using ParameterValue = std::variant<double, std::string>;
std::optional<ParameterValue> recipe_parameter(const std::string& recipe, const std::string& parameter);

/// Divides trajectories by a rule. Those without the parameter are for training. recipes: JSON texts of the
/// complete trajectories, by their ids. The split's rule tells parameter and limits. Throws
/// std::invalid_argument if a part would be empty.
DatasetSplit split_by_parameter(const HoldOutRule& rule, const std::map<int, std::string>& recipes);

/// Throws std::invalid_argument if the plan's rule leaves a part empty, were all its trajectories complete.
void check_hold_out(const DatasetPlan& plan, const Body& body);

}  // namespace nbd

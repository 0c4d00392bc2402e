#include "apps/dataset/value_table.hpp"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>
#include <vector>

#include "meshing/formats/words.hpp"

namespace nbd {
namespace {

using Cells = std::map<std::string, std::string>;

/// Adds a value, or its members as name.x, name.y, name.z or name.key.
void add_cells(const std::string& name, const nlohmann::json& value, Cells& cells) {
    if (value.is_object()) {
        for (const auto& [key, member] : value.items()) add_cells(name + "." + key, member, cells);
    } else if (value.is_array()) {
        for (std::size_t i = 0; i < value.size(); ++i)
            add_cells(i < 3 ? fmt::format("{}.{}", name, "xyz"[i]) : fmt::format("{}.{}", name, i), value[i],
                      cells);
    } else {
        cells[name] = value.is_string() ? value.get<std::string>() : value.dump();
    }
}

}  // namespace

std::string value_table(const RecordingReader& dataset) {
    std::vector<std::pair<std::string, Cells>> rows;  // the draw, and the variables
    std::set<std::string> names;
    for (const TrajectoryInfo& info : dataset.trajectories()) {
        const nlohmann::json recipe = nlohmann::json::parse(info.recipe.str());
        auto& [draw, cells] = rows.emplace_back(recipe.value("draw", nlohmann::json(0)).dump(), Cells());
        const nlohmann::json values = recipe.value("variables", nlohmann::json::object());
        for (const auto& [name, value] : values.items()) add_cells(name, value, cells);
        for (const auto& [name, cell] : cells) names.insert(name);
    }
    std::string text = "trajectory,drawn_again";
    for (const std::string& name : names) text += "," + name;
    text += ",frames,failure\n";
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const TrajectoryInfo& info = dataset.trajectories()[i];
        text += fmt::format("{},{}", info.id, rows[i].first);
        for (const std::string& name : names) text += fmt::format(",{}", csv_cell(rows[i].second[name]));
        text += fmt::format(",{},{}\n", info.frames, csv_cell(info.failure));
    }
    return text;
}

}  // namespace nbd

#include "sim/excitation/recipe_obstacles.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

namespace nbd {
namespace {

Eigen::Vector3d vector_from(const nlohmann::json& numbers) {
    return {numbers.at(0).get<double>(), numbers.at(1).get<double>(), numbers.at(2).get<double>()};
}

}  // namespace

std::vector<Obstacle> recipe_obstacles(const Recipe& recipe) {
    std::vector<Obstacle> obstacles;
    if (recipe.floor)
        obstacles.push_back(
            {.shape = PlaneShape{.point = {0, 0, *recipe.floor}, .normal = Eigen::Vector3d::UnitZ()}});
    for (const Plate& plate : recipe.plates)
        obstacles.push_back({.shape = PlaneShape{.point = plate.point, .normal = plate.normal},
                             .velocity = plate.speed * plate.normal,
                             .stop = plate.stop});
    return obstacles;
}

std::vector<Obstacle> recipe_obstacles(std::string_view json) {
    const auto text = nlohmann::json::parse(json, nullptr, false);
    if (!text.is_object() || !text.contains("kind")) return {};
    Recipe recipe;
    try {
        if (text.contains("floor")) recipe.floor = text["floor"].get<double>();
        for (const auto& plate : text.value("plates", nlohmann::json::array()))
            recipe.plates.push_back({.point = vector_from(plate.at("point")),
                                     .normal = vector_from(plate.at("normal")),
                                     .speed = plate.at("speed").get<double>(),
                                     .stop = plate.at("stop").get<double>()});
    } catch (const nlohmann::json::exception& error) {
        throw std::invalid_argument(std::string("the obstacles of its recipe cannot be read: ") +
                                    error.what());
    }
    std::vector<Obstacle> obstacles = recipe_obstacles(recipe);
    for (const Obstacle& obstacle : obstacles) check_obstacle(obstacle);
    return obstacles;
}

}  // namespace nbd

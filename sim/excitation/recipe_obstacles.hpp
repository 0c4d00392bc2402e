#pragma once

#include <string_view>
#include <vector>

#include "sim/excitation/recipe.hpp"
#include "sim/obstacles/obstacle.hpp"

namespace nbd {

/// The rigid obstacles of a recipe: its floor, and plates that move. The thrown copy is not one of them.
std::vector<Obstacle> recipe_obstacles(const Recipe& recipe);

/// Likewise from the text that recipe_json() makes and a trajectory keeps; none from a text that is not a
/// recipe's. Throws std::invalid_argument, one line, if its floor or plates cannot be used.
std::vector<Obstacle> recipe_obstacles(std::string_view json);

}  // namespace nbd

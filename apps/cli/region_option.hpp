#pragma once

#include <string>
#include <utility>
#include <vector>

#include "meshing/body/material.hpp"

namespace nbd {

/// Reads "NAME:key=value,key=value"; keys are young, poisson, density and law. Throws CLI::ValidationError
/// with what is wrong and what was allowed; ranges are checked where the material is used.
std::pair<std::string, MaterialChange> parse_region(const std::string& text);

std::vector<std::string> names_of_laws();

}  // namespace nbd

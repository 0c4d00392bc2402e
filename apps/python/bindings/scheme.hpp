#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

#include "meshing/surface/subdivide.hpp"

namespace nbd::python {

/// The scheme with this name. Throws std::invalid_argument for another one.
inline SubdivisionScheme scheme_named(const std::string& text) {
    if (text == "midpoint") return SubdivisionScheme::midpoint;
    if (text == "loop") return SubdivisionScheme::loop;
    throw std::invalid_argument(fmt::format("scheme: is \"{}\"; allowed: midpoint, loop", text));
}

}  // namespace nbd::python

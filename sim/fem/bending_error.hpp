#pragma once

#include <optional>

#include "meshing/body/body.hpp"

namespace nbd {

/// By how much a body yields too little to its own weight, which acts along its shortest axis while its end
/// is held, for small displacements: the missing share of the work, as an estimate from richer elements on
/// the same shape. For linear tetrahedra these are quadratic ones; for quadratic ones, those of tetrahedra
/// split into eight, with a third more of the difference for what splitting goes on to find, as where
/// stresses are infinite at the held end. What differs in shape from the surface is not part of it.
/// most_tets: of the richer body; empty beyond it, and where fewer than three nodes lie at the end, or the
/// body is in several parts.
std::optional<double> bending_error(const Body& body, int most_tets = 24'000);

}  // namespace nbd

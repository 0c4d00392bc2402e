#pragma once

#include <optional>

#include "meshing/body/body.hpp"

namespace nbd {

/// By how much a body yields too little, or in rubber too much (see ElasticBody), to forces that bend it, for
/// small displacements: the wrong share of the work, as an estimate from richer elements on the same shape.
/// The forces act along its shortest axis of inertia, grow with the square of the way along the longest, and
/// neither move nor turn it. For linear tetrahedra the richer ones are quadratic; for quadratic ones, those
/// of tetrahedra split into eight, with a third more of the difference for what splitting goes on to find.
/// What differs in shape from the surface is not part of it.
///
/// solid: what fills tetrahedra that are not full, as for material_fill(). most_tets: of the richer body.
/// Empty beyond it, where the body is in several parts, and where quadratic tetrahedra are not full and the
/// solid is not known.
std::optional<double> bending_error(const Body& body, int most_tets = 24'000, const TriMesh* solid = nullptr);

}  // namespace nbd

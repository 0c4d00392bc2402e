#pragma once

#include "meshing/body/body.hpp"

namespace nbd::test {

/// A body that uses the boundary of its tetrahedra as surface.
Body boundary_body(TetMesh tets, const Material& material = {});

/// An axis-aligned box centred at the origin.
Body box_body(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, const Material& material = {});

/// Such a box whose surface is subdivided this often, so that most vertices hang on several nodes.
Body fine_box_body(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, int levels,
                   const Material& material = {});

}  // namespace nbd::test

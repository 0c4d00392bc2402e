#pragma once

#include <string>

#include "meshing/body.hpp"
#include "training/surface_body.hpp"

namespace nbd {

/// What training needs of a body, in float32. Modes are carried along if the body has them.
SurfaceBody surface_body(const Body& body);

/// Throws std::runtime_error unless the folder that `path` would stand in is there, so that a long command
/// fails before its work and not after it.
void check_output(const std::string& path);

}  // namespace nbd

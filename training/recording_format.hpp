#pragma once

#include <fmt/format.h>

#include "meshing/h5/types.hpp"

namespace nbd {

/// What writer and reader of recordings agree on.
inline const h5::Format recording_format{"nbdtree recording", 1};

inline std::string trajectory_group(int id) { return fmt::format("trajectories/{:06}", id); }

}  // namespace nbd

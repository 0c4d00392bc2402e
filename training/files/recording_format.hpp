#pragma once

#include <fmt/format.h>

#include "meshing/h5/types.hpp"

namespace nbd {

/// What writers and reader of recordings agree on. Version 2 is a merged view, whose positions lie in other
/// files; the writer's root label `dataset_label` tells files that belong together.
inline const h5::Format recording_format{"nbdtree recording", 1};
inline const h5::Format view_format{"nbdtree recording", 2};
inline constexpr const char* dataset_label = "dataset";

inline std::string trajectory_group(int id) { return fmt::format("trajectories/{:06}", id); }

}  // namespace nbd

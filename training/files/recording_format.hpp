#pragma once

#include <fmt/format.h>

#include "meshing/h5/types.hpp"

namespace nbd {

/// Format and names shared by the writers and the reader of recordings. Version 2 is a merged view, whose
/// positions are stored in other files. Files of one dataset share the value of the root label
/// `dataset_label`.
inline const h5::Format recording_format{"nbdtree recording", 1};
inline const h5::Format view_format{"nbdtree recording", 2};
inline constexpr const char* dataset_label = "dataset";
inline constexpr const char* contact_forces_name = "contact_forces";  // in the group of a trajectory

inline std::string trajectory_group(int id) { return fmt::format("trajectories/{:06}", id); }

}  // namespace nbd

#pragma once

#include <fmt/format.h>

#include <span>
#include <string>

#include "meshing/h5/types.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// Format and names shared by the writers and the reader of recordings. Version 2 is a merged view, whose
/// positions are stored in other files. Files of one dataset share the value of the root label
/// `dataset_label`.
inline const h5::Format recording_format{"nbdtree recording", 1};
inline const h5::Format view_format{"nbdtree recording", 2};
/// What positions are counted from, [3] float64; a file without it counts from zero.
inline constexpr const char* origin_name = "origin";

inline constexpr const char* dataset_label = "dataset";
inline constexpr const char* dataset_plan = "dataset/plan";  // a text that views have

/// In the group of a trajectory: edges of all frames, [edges, 3], and where those of each frame begin.
inline constexpr const char* contact_edges_name = "contact_edges";
inline constexpr const char* contact_edge_offsets_name = "contact_edge_offsets";
inline constexpr const char* contact_distance_name = "distance";  // their attributes
inline constexpr const char* self_contact_distance_name = "self_distance";

inline std::string trajectory_group(int id) { return fmt::format("trajectories/{:06}", id); }

/// What is wrong with the edges of a frame, and what was allowed; "" if nothing is. id: of the trajectory.
std::string edge_defect(std::span<const ContactEdge> edges, int id);

}  // namespace nbd

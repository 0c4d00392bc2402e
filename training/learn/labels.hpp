#pragma once

#include <span>
#include <string_view>

#include "collision/bounds/learned/modal_coordinates.hpp"
#include "collision/topology/sphere_tree.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/surface_body.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {

/// The frame that label spheres are expressed in. `clustered`: the one that the code is computed in and the
/// sphere is taken to the world from, so that alignment errors cancel. `full`: rigid alignment over all
/// vertices, as the paper has it; the difference of the two alignments is then left to the networks.
enum class LabelFrame { clustered, full };

/// "clustered", "full".
std::string_view name(LabelFrame frame) noexcept;

/// Throws std::invalid_argument naming the known frames.
LabelFrame label_frame(std::string_view name);

/// What networks are trained on, before scaling.
struct PoseLabels {
    PoseRows z;        // [poses, m] zhat (equation 4)
    PoseRows spheres;  // [poses, 4 nodes] dc x y z, dr of every node: sphere in the pose minus rest sphere,
                       // in metres (equation 5)
};

/// Visits the frames once. Same bits on any number of threads.
PoseLabels compute_labels(const SurfaceBody& body, const SphereTree& tree, const ClusteredModes& modes,
                          FrameSource& source, std::span<const FrameId> frames, LabelFrame frame);

/// Middle and half width of every column's range.
struct ColumnRange {
    Eigen::VectorXf centre, half;

    /// 1 / half, and 0 for a column that never changed: what it brings later is ignored.
    Eigen::VectorXf scale() const;
};

ColumnRange column_range(const PoseRows& x);

/// x becomes (x - centre) / half, column by column, and 0 where half is 0.
void scale_columns(PoseRows& x, const ColumnRange& range);

}  // namespace nbd

#pragma once

#include <span>
#include <string_view>

#include "collision/nbd_tree/modal_coordinates.hpp"
#include "collision/nbd_tree/sphere_tree.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/surface_body.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {

/// Frame of the label spheres. `clustered`: the frame in which z is computed and from which spheres are moved
/// to the world, so that alignment errors cancel. `full`: rigid alignment over all vertices, as in the paper;
/// the networks then have to learn the difference between the two alignments.
enum class LabelFrame { clustered, full };

/// Name of a frame: "clustered" or "full".
std::string_view name(LabelFrame frame) noexcept;

/// Training inputs and targets of the networks, before scaling.
struct PoseLabels {
    PoseRows z;        // [poses, m] zhat (equation 4)
    PoseRows spheres;  // [poses, 4 nodes] dc x y z, dr of every node: sphere in the pose minus rest sphere,
                       // in metres (equation 5)
};

/// Visits the frames once. Same bits on any number of threads.
PoseLabels compute_labels(const SurfaceBody& body, const SphereTree& tree, const ClusteredModes& modes,
                          FrameSource& source, std::span<const FrameId> frames, LabelFrame frame);

/// Centre and half width of every column's range.
struct ColumnRange {
    Eigen::VectorXf centre, half;

    /// 1 / half, or 0 for a constant column, which makes later changes in it have no effect.
    Eigen::VectorXf scale() const;
};

ColumnRange column_range(const PoseRows& x);

/// x becomes (x - centre) / half, column by column, and 0 where half is 0.
void scale_columns(PoseRows& x, const ColumnRange& range);

}  // namespace nbd

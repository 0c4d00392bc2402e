#include "training/learn/labels.hpp"

#include <limits>
#include <vector>

namespace nbd {

std::string_view name(LabelFrame frame) noexcept { return frame == LabelFrame::full ? "full" : "clustered"; }

PoseLabels compute_labels(const SurfaceBody& body, const SphereTree& tree, const ClusteredModes& modes,
                          FrameSource& source, std::span<const FrameId> frames, LabelFrame frame) {
    const Eigen::Index poses = frames.size();
    const Eigen::Index nodes = tree.nodes.size();
    PoseLabels labels{PoseRows(poses, modes.U.cols()), PoseRows(poses, MlpShape::outputs * nodes)};
    const Eigen::VectorXf ones = Eigen::VectorXf::Ones(body.X.rows());
    std::vector<ModalCoordinatesScratch> scratch(frame_slots);
    source.for_each_frame(frames, [&](int slot, int index, VerticesRef x) {
        RigidTransform align = modal_coordinates(modes, x, scratch[slot], labels.z.row(index).transpose());
        if (frame == LabelFrame::full) align = match_shape(body.X, x, ones);
        for (Eigen::Index i = 0; i < nodes; ++i) {
            // The bounding sphere moves with the body, so aligning the world-space sphere gives the aligned
            // one.
            const Sphere s = bounding_sphere(x, tree.node_vertices(i));
            const Sphere& rest = tree.rest[i];
            auto label = labels.spheres.row(index).segment<4>(4 * i);
            label.head<3>() = (align.R.transpose() * (s.c - align.t) - rest.c).transpose();
            label[3] = s.r - rest.r;
        }
    });
    return labels;
}

Eigen::VectorXf ColumnRange::scale() const {
    return half.unaryExpr([](float h) { return h > std::numeric_limits<float>::min() ? 1 / h : 0.f; });
}

ColumnRange column_range(const PoseRows& x) {
    const Eigen::VectorXf lowest = x.colwise().minCoeff(), highest = x.colwise().maxCoeff();
    return {0.5f * (lowest + highest), 0.5f * (highest - lowest)};
}

void scale_columns(PoseRows& x, const ColumnRange& range) {
    const Eigen::RowVectorXf centre = range.centre.transpose(), scale = range.scale().transpose();
    for (Eigen::Index p = 0; p < x.rows(); ++p) x.row(p) = (x.row(p) - centre).cwiseProduct(scale);
}

}  // namespace nbd

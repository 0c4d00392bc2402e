#include "apps/figures/test_pose.hpp"

#include <algorithm>
#include <vector>

namespace nbd {
namespace {

constexpr int looked_at = 65;  // frames to choose from

Vertices aligned(VerticesRef X, VerticesRef x) {
    const RigidTransform align = match_shape(X, x, Eigen::VectorXf::Ones(X.rows()));
    return (x.rowwise() - align.t.transpose()) * align.R;
}

}  // namespace

TestPose typical_pose(const TreeFile& tree, const RecordingReader& recording,
                      std::span<const FrameId> frames) {
    const SurfaceBody body = surface_body(tree);
    const float size = (body.X.colwise().maxCoeff() - body.X.colwise().minCoeff()).norm();
    const std::vector<FrameId> candidates = spread(frames, looked_at);
    std::vector<std::pair<double, FrameId>> deformed(candidates.size());
    const auto deformation = [&](const Vertices& y) {
        return static_cast<double>((y - body.X).rowwise().norm().mean() / size);
    };
    for_each_frame(body, recording, candidates, [&](int, int index, VerticesRef x) {
        const std::size_t i = index;
        deformed[i] = {deformation(aligned(body.X, x)), candidates[i]};
    });
    const auto middle = deformed.begin() + static_cast<std::ptrdiff_t>(deformed.size() / 2);
    std::nth_element(deformed.begin(), middle, deformed.end());

    const FrameId chosen = middle->second;
    const auto& info = recording.trajectories()[chosen.trajectory];
    TestPose pose{info.id, chosen.frame, middle->first, {}};
    for_each_frame(body, recording, std::span(&chosen, 1),
                   [&](int, int, VerticesRef x) { pose.x = aligned(body.X, x); });
    return pose;
}

}  // namespace nbd

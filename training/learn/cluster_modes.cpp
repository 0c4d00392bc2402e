#include "training/learn/cluster_modes.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <vector>

#include "meshing/progress/progress.hpp"

namespace nbd {

namespace {

ClusteredModes select_rows(const SurfaceBody& body, const Clustering& clustering) {
    ClusteredModes modes;
    modes.representatives = clustering.representatives;
    modes.w = clustering.sizes;
    const Eigen::Index k = modes.representatives.size();
    modes.X.resize(k, 3);
    Eigen::MatrixXf U(3 * k, body.U.cols());
    for (Eigen::Index i = 0; i < k; ++i) {
        const Eigen::Index v = modes.representatives[i];
        modes.X.row(i) = body.X.row(v);
        U.middleRows<3>(3 * i) = body.U.middleRows<3>(3 * v);
    }
    modes.U = FixedMatrix(U);
    return modes;
}

/// z = U^T (y - X), with y aligned over all vertices (equations 1 and 3).
Eigen::VectorXf exact_z(const SurfaceBody& body, VerticesRef x) {
    const Eigen::Index n = x.rows();
    const RigidTransform align = match_shape(body.X, x, Eigen::VectorXf::Ones(n));
    const Vertices d = (x.rowwise() - align.t.transpose()) * align.R - body.X;
    return body.U.transpose() * Eigen::Map<const Eigen::VectorXf>(d.data(), 3 * n);
}

}  // namespace

ClusteredModesChoice cluster_modes(const SurfaceBody& body, FrameSource& source,
                                   std::span<const FrameId> frames, const ClusterModesConfig& config) {
    if (config.initialisations < 1)
        throw std::invalid_argument(
            fmt::format("{} initialisations of k-means, at least 1 needed", config.initialisations));
    if (config.poses < 1)
        throw std::invalid_argument(
            fmt::format("{} poses to choose clusters by, at least 1 needed", config.poses));
    const Eigen::Index n = body.X.rows(), m = body.U.cols();
    const Eigen::Map<const PointRows> points(body.U.data(), n, 3 * m);
    std::vector<ClusteredModes> candidates;
    for (int i = 0; i < config.initialisations; ++i) {
        tell_progress("initialisations", i, config.initialisations);
        candidates.push_back(select_rows(body, k_means(points, config.k_means, i)));
    }
    tell_progress("initialisations", config.initialisations, config.initialisations);

    const std::vector<FrameId> sample = spread(frames, config.poses);
    const Eigen::Index poses = sample.size();
    Eigen::MatrixXd error(poses, config.initialisations);
    Eigen::VectorXd length(poses);
    std::vector<ModalCoordinatesScratch> scratch(frame_slots);
    source.for_each_frame(sample, [&](int slot, int index, VerticesRef x) {
        const Eigen::VectorXf z = exact_z(body, x);
        length[index] = static_cast<double>(z.norm());
        Eigen::VectorXf zhat(m);
        for (int i = 0; i < config.initialisations; ++i) {
            modal_coordinates(candidates[i], x, scratch[slot], zhat);
            error(index, i) = static_cast<double>((z - zhat).norm());
        }
    });

    Eigen::Index best = 0;
    error.colwise().mean().minCoeff(&best);
    // Poses near the rest pose have z near 0, hence no relative error.
    const double smallest = 1e-9 * (length.maxCoeff() + 1e-30);
    double sum = 0;
    int moved = 0;
    for (Eigen::Index p = 0; p < poses; ++p) {
        if (length[p] <= smallest) continue;
        sum += error(p, best) / length[p];
        ++moved;
    }
    return {std::move(candidates[best]), moved > 0 ? sum / moved : 0};
}

}  // namespace nbd

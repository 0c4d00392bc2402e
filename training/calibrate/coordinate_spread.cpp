#include "training/calibrate/coordinate_spread.hpp"

#include <Eigen/Cholesky>
#include <stdexcept>
#include <utility>
#include <vector>

namespace nbd {

PoseRows scaled_coordinates(FrameSource& source, std::span<const FrameId> frames, const NbdModel& model) {
    const Eigen::Index m = model.mode_count();
    PoseRows scaled(frames.size(), m);
    std::vector<ModalCoordinatesScratch> scratch(frame_slots);
    std::vector<Eigen::VectorXf> z(frame_slots, Eigen::VectorXf(m));
    source.for_each_frame(frames, [&](int slot, int index, VerticesRef x) {
        const std::size_t s = slot;
        modal_coordinates(model.modes, x, scratch[s], z[s]);
        scaled.row(index) = (z[s] - model.z_centre).cwiseProduct(model.z_scale).transpose();
    });
    return scaled;
}

CoordinateSpread coordinate_spread(const PoseRows& z) {
    if (z.rows() == 0)
        throw std::invalid_argument("no poses to measure the spread of the modal coordinates on");
    const Eigen::Index m = z.cols();
    const Eigen::MatrixXd Z = z.cast<double>();
    const Eigen::RowVectorXd mean = Z.colwise().mean();
    const Eigen::MatrixXd centred = Z.rowwise() - mean;
    Eigen::MatrixXd covariance = centred.transpose() * centred / static_cast<double>(z.rows());
    constexpr double ridge = 1e-3;  // of the mean variance of a coordinate
    covariance.diagonal().array() += ridge * covariance.trace() / static_cast<double>(m) + 1e-12;
    const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
    return {mean.transpose().cast<float>(),
            factor.matrixL().solve(Eigen::MatrixXd::Identity(m, m)).cast<float>()};
}

void fit_coordinate_spread(const PoseRows& z, NbdModel& model) {
    CoordinateSpread spread = coordinate_spread(z);
    model.z_mean = std::move(spread.mean);
    model.z_whitening = std::move(spread.whitening);
}

}  // namespace nbd

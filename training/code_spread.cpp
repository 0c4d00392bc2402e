#include "training/code_spread.hpp"

#include <Eigen/Cholesky>
#include <stdexcept>
#include <vector>

namespace nbd {

PoseRows scaled_codes(const SurfaceBody& body, const RecordingReader& recording,
                      std::span<const FrameId> frames, const ModalModel& model) {
    const Eigen::Index m = model.mode_count();
    PoseRows codes(static_cast<Eigen::Index>(frames.size()), m);
    std::vector<ModalCodeScratch> scratch(frame_slots);
    std::vector<Eigen::VectorXf> z(frame_slots, Eigen::VectorXf(m));
    for_each_frame(body, recording, frames, [&](int slot, int index, VerticesRef x) {
        const auto s = static_cast<std::size_t>(slot);
        modal_code(model.modes, x, scratch[s], z[s]);
        codes.row(index) = (z[s] - model.z_centre).cwiseProduct(model.z_scale).transpose();
    });
    return codes;
}

void fit_code_spread(const PoseRows& codes, ModalModel& model) {
    if (codes.rows() == 0) throw std::invalid_argument("no poses to measure the spread of codes on");
    const Eigen::Index m = codes.cols();
    const Eigen::MatrixXd Z = codes.cast<double>();
    const Eigen::RowVectorXd mean = Z.colwise().mean();
    const Eigen::MatrixXd centred = Z.rowwise() - mean;
    Eigen::MatrixXd covariance = centred.transpose() * centred / static_cast<double>(codes.rows());
    constexpr double ridge = 1e-3;  // of the mean variance of a coordinate
    covariance.diagonal().array() += ridge * covariance.trace() / static_cast<double>(m) + 1e-12;
    const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
    model.code_mean = mean.transpose().cast<float>();
    model.code_whitening = factor.matrixL().solve(Eigen::MatrixXd::Identity(m, m)).cast<float>();
}

}  // namespace nbd

#include <gtest/gtest.h>

#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/on_threads.hpp"
#include "tests/training/bar.hpp"
#include "training/calibrate/bound_scores.hpp"
#include "training/learn/cluster_modes.hpp"

namespace nbd {
namespace {

using test::Bar;
using test::error_of;

class CoordinateSpread : public test::FileTest {};

TEST_F(CoordinateSpread, WhitensTheCoordinatesOfTheTrainingPoses) {
    const Bar bar(6);
    bar.record(folder / "data.h5", 40, 10, 3);
    const RecordingReader data(folder / "data.h5");
    FrameSource source(bar.body.W, data);
    const std::vector<FrameId> frames = complete_frames(data);
    NbdModel model;
    model.modes = cluster_modes(bar.body, source, frames, {.k_means = {.clusters = 40}}).modes;
    model.z_centre = Eigen::VectorXf::Constant(6, 0.3f);
    model.z_scale = Eigen::VectorXf::LinSpaced(6, 0.5f, 2.f);
    fit_coordinate_spread(scaled_coordinates(source, frames, model), model);
    ASSERT_EQ(model.z_mean.size(), 6);

    Eigen::MatrixXd z(frames.size(), 6);
    ModalCoordinatesScratch scratch;
    Eigen::VectorXf of_pose(6);
    Vertices nodes, x;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        data.read(frames[i].trajectory, frames[i].frame, 1, nodes);
        apply_embedding(bar.body.W, nodes, x);
        modal_coordinates(model.modes, x, scratch, of_pose);
        z.row(i) = (of_pose - model.z_centre).cwiseProduct(model.z_scale).cast<double>().transpose();
    }
    const Eigen::VectorXd mean = z.colwise().mean().transpose();
    EXPECT_LT((mean - model.z_mean.cast<double>()).norm(), 1e-6 * (1 + mean.norm()));
    z.rowwise() -= mean.transpose();
    Eigen::MatrixXd covariance = z.transpose() * z / double(z.rows());
    covariance.diagonal().array() +=
        1e-3 * covariance.trace() / 6;  // regularises directions that the poses hardly span
    const Eigen::MatrixXd whitening = model.z_whitening.cast<double>();
    EXPECT_LT((whitening * covariance * whitening.transpose() - Eigen::MatrixXd::Identity(6, 6)).norm(),
              1e-4);
}

TEST_F(CoordinateSpread, GivesTheSameBitsOnAnyNumberOfThreadsAndNeedsPoses) {
    const Bar bar(5);
    bar.record(folder / "data.h5", 8, 10, 4);
    const RecordingReader data(folder / "data.h5");
    FrameSource source(bar.body.W, data);
    const std::vector<FrameId> frames = complete_frames(data);
    NbdModel model;
    model.modes = cluster_modes(bar.body, source, frames, {.k_means = {.clusters = 30}}).modes;
    model.z_centre = Eigen::VectorXf::Zero(5);
    model.z_scale = Eigen::VectorXf::Ones(5);
    const auto on = [&](int threads) {
        return test::on_threads(threads, [&] { return scaled_coordinates(source, frames, model); });
    };
    EXPECT_EQ(on(1), on(4));
    EXPECT_EQ(error_of([&] { fit_coordinate_spread(PoseRows(0, 5), model); }),
              "no poses to measure the spread of the modal coordinates on");
}

TEST_F(CoordinateSpread, ScoresItsOwnPosesAsIfTheyWereHeldOut) {
    const Bar bar(6);
    bar.record(folder / "data.h5", 12, 4, 5);
    const RecordingReader data(folder / "data.h5");
    FrameSource source(bar.body.W, data);
    const std::vector<FrameId> frames = complete_frames(data);
    CollisionTree tree = make_exact_tree(bar.body.X, bar.body.F, {.depth = 1});
    NbdModel& model = tree.nbd.emplace();
    model.modes = cluster_modes(bar.body, source, frames, {.k_means = {.clusters = 40}}).modes;
    model.z_centre = Eigen::VectorXf::Zero(6);
    model.z_scale = Eigen::VectorXf::Ones(6);
    const std::vector<float> weights(3 * static_cast<std::size_t>(NbdNetworks::weight_count(6, 4)), 0.f);
    model.networks = NbdNetworks(6, 4, weights);
    model.out_centre = model.out_scale = Eigen::MatrixXf::Zero(4, 3);
    model.out_centre.row(3).setConstant(10);  // large enough to hold every representative
    fit_coordinate_spread(scaled_coordinates(source, frames, model), model);
    const auto known = refer_to(tree);
    const BoundScores plain = score_bounds(*known, BoundKind::nbd, source, frames),
                      fair = score_shape(*known, BoundKind::nbd, source, frames);
    EXPECT_EQ(fair.trajectories, plain.trajectories);
    EXPECT_EQ(fair.excess, plain.excess);
    // A mean of squares is 1 with the pose included, so leaving the pose out raises its score.
    EXPECT_GT(fair.ood_score.col(0).mean(), 1.05f * plain.ood_score.col(0).mean());
    EXPECT_EQ(score_shape(*known, BoundKind::nbd, source, std::span(frames).first(4)).ood_score,
              plain.ood_score.topRows(4));  // a single trajectory cannot be left out
}

}  // namespace
}  // namespace nbd

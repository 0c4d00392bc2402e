#include "training/learn/labels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "collision/nbd_tree/leaf_boxes.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/on_threads.hpp"
#include "tests/training/bar.hpp"
#include "training/files/split.hpp"
#include "training/learn/cluster_modes.hpp"
#include "training/learn/samples.hpp"

namespace nbd {
namespace {

using test::Bar;

class Labels : public test::FileTest {
 protected:
    Bar bar{12, 3};
    SphereTree tree = build_sphere_tree(bar.body.X, bar.body.F, {.depth = 3});

    ClusteredModes modes(const RecordingReader& data) {
        FrameSource source(bar.body.W, data);
        return cluster_modes(bar.body, source, complete_frames(data),
                             {.k_means = {.clusters = 40}, .initialisations = 1})
            .modes;
    }
};

TEST_F(Labels, AreZeroForARigidlyMovedRestPose) {
    std::vector<Vertices> poses;
    for (int f = 0; f < 20; ++f)
        poses.push_back(bar.pose(0, 0, 0, Eigen::Quaterniond(1, 0.3 * f, 1 - 0.1 * f, 0.5).normalized(),
                                 {10.0 * f, -3, 1}));
    const RecordingReader data = bar.recorded(folder / "data.h5", poses);
    FrameSource source(bar.body.W, data);
    for (const LabelFrame frame : {LabelFrame::clustered, LabelFrame::full}) {
        const PoseLabels labels =
            compute_labels(bar.body, tree, modes(data), source, complete_frames(data), frame);
        ASSERT_EQ(labels.spheres.rows(), 20);
        ASSERT_EQ(labels.spheres.cols(), 4 * static_cast<int>(tree.nodes.size()));
        // At 200 m from the origin, float32 positions are accurate to 8e-6 m.
        EXPECT_LT(labels.spheres.cwiseAbs().maxCoeff(), 1e-4) << name(frame);
        EXPECT_LT(labels.z.cwiseAbs().maxCoeff(), 1e-2) << name(frame);
    }
}

TEST_F(Labels, ReproduceTheExactWorldSpheresInTheClusteredFrame) {
    bar.record(folder / "data.h5", 2, 25, 3);
    const RecordingReader data(folder / "data.h5");
    FrameSource source(bar.body.W, data);
    const ClusteredModes chosen = modes(data);
    const auto frames = complete_frames(data);
    const PoseLabels labels = compute_labels(bar.body, tree, chosen, source, frames, LabelFrame::clustered);
    ModalCoordinatesScratch scratch;
    Eigen::VectorXf z(12);
    double largest = 0;
    const auto compare = [&](int, int index, VerticesRef x) {
        const RigidTransform align = modal_coordinates(chosen, x, scratch, z);
        EXPECT_EQ(z, labels.z.row(index).transpose());
        for (int i = 0; i < std::ssize(tree.nodes); ++i) {
            const Sphere& rest = tree.rest[i];
            const Sphere exact = bounding_sphere(x, tree.node_vertices(i));
            const auto label = labels.spheres.row(index).segment<4>(4 * i);
            EXPECT_LT((align.R * (rest.c + label.head<3>().transpose()) + align.t - exact.c).norm(), 1e-5);
            EXPECT_NEAR(rest.r + label[3], exact.r, 1e-5);
            largest = std::max(largest, static_cast<double>(label.norm()));
        }
    };
    test::on_threads(1, [&] { source.for_each_frame(frames, compare); });
    EXPECT_GT(largest, 0.2);
}

TEST_F(Labels, AlignToAllVerticesInTheFullFrame) {
    bar.record(folder / "data.h5", 2, 10, 3);
    const RecordingReader data(folder / "data.h5");
    FrameSource source(bar.body.W, data);
    const ClusteredModes chosen = modes(data);
    const auto frames = complete_frames(data);
    const auto full = compute_labels(bar.body, tree, chosen, source, frames, LabelFrame::full);
    const auto clustered = compute_labels(bar.body, tree, chosen, source, frames, LabelFrame::clustered);
    EXPECT_EQ(full.z, clustered.z);
    EXPECT_NE(full.spheres, clustered.spheres);
    source.for_each_frame(frames, [&](int, int index, VerticesRef x) {
        const auto align = match_shape(bar.body.X, x, Eigen::VectorXf::Ones(x.rows()));
        const Sphere exact = bounding_sphere(x, tree.node_vertices(0));
        EXPECT_LT(
            (align.R * (tree.rest[0].c + full.spheres.row(index).head<3>().transpose()) + align.t - exact.c)
                .norm(),
            1e-5);
    });
}

TEST_F(Labels, AreTheSameBitsOnAnyNumberOfThreads) {
    bar.record(folder / "data.h5", 3, 50, 3);
    const RecordingReader data(folder / "data.h5");
    FrameSource source(bar.body.W, data);
    const ClusteredModes chosen = modes(data);
    const auto frames = complete_frames(data);
    const auto run = [&] { return compute_labels(bar.body, tree, chosen, source, frames, LabelFrame::full); };
    const auto one = test::on_threads(1, run), two = test::on_threads(2, run);
    EXPECT_EQ(one.z, two.z);
    EXPECT_EQ(one.spheres, two.spheres);
}

TEST(ScaleColumns, ScalesEveryColumnToPlusMinusOneAndBack) {
    PoseRows x(4, 3);
    x << 1, 5, -2e-3f, 3, 5, 4e-3f, 2, 5, 0, 7, 5, 1e-3f;
    const PoseRows before = x;
    const ColumnRange range = column_range(x);
    scale_columns(x, range);
    EXPECT_NEAR(x.col(0).maxCoeff(), 1, 1e-6);
    EXPECT_NEAR(x.col(0).minCoeff(), -1, 1e-6);
    EXPECT_NEAR(x.col(2).maxCoeff(), 1, 1e-6);
    EXPECT_TRUE((x.col(1).array() == 0).all());  // a constant column
    EXPECT_EQ(range.scale()[1], 0);
    for (int p = 0; p < 4; ++p)
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(x(p, c) * range.half[c] + range.centre[c], before(p, c),
                        1e-6f * std::abs(before(p, c)) + 1e-9);
}

struct Samples : testing::Test {
    Bar bar{0, 8};
    std::vector<int> all = numbers(bar.body.X.rows());

    static std::vector<int> numbers(int count) {
        std::vector<int> list(count);
        std::iota(list.begin(), list.end(), 0);
        return list;
    }
    /// Surfaces in the frames of some trajectories.
    std::vector<Vertices> poses(std::uint64_t seed) const {
        std::vector<Vertices> list;
        for (int frame = 0; frame < 40; ++frame)
            apply_embedding(bar.body.W, bar.frame(seed, frame % 4, frame), list.emplace_back());
        return list;
    }
};

TEST_F(Samples, AreDifferentVerticesOfThePatch) {
    const std::vector<Vertices> seen = poses(2);
    const std::vector<int> patch(all.begin() + 40, all.begin() + 140);
    for (const SampleRule rule : {SampleRule::spread, SampleRule::support}) {
        const std::vector<int> samples = choose_samples(bar.body.X, seen, patch, rule, 32);
        EXPECT_EQ(samples.size(), 32u);
        EXPECT_EQ(std::set<int>(samples.begin(), samples.end()).size(), 32u);
        for (const int v : samples) EXPECT_TRUE(v >= 40 && v < 140) << v;
    }
}

TEST_F(Samples, OfASmallPatchAreAllItsVertices) {
    const std::vector<Vertices> seen = poses(2);
    const std::vector<int> patch = {9, 4, 4, 30, 7};
    const std::vector<int> expected = {4, 7, 9, 30, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4};
    for (const SampleRule rule : {SampleRule::spread, SampleRule::support})
        EXPECT_EQ(choose_samples(bar.body.X, seen, patch, rule, 32), expected);
}

TEST_F(Samples, BySupportReachFartherOutInUnseenPoses) {
    const std::vector<Vertices> seen = poses(2);
    const auto protrusion = [&](SampleRule rule) {
        const std::vector<int> samples = choose_samples(bar.body.X, seen, all, rule, 16);
        double sum = 0;
        for (const Vertices& x : poses(99)) {
            const VertexView view(x);
            sum += double{outside(bounding_box(view, samples), bounding_box(view, all))};
        }
        return sum;
    };
    const double support = protrusion(SampleRule::support), spread = protrusion(SampleRule::spread);
    EXPECT_GT(spread, 0);
    EXPECT_LT(support, 0.7 * spread);
}

}  // namespace
}  // namespace nbd

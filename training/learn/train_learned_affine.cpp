#include "training/learn/train_learned_affine.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "collision/base/counter_random.hpp"
#include "collision/kernels/box_pack.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "meshing/progress/progress.hpp"
#include "training/learn/samples.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {
namespace {

constexpr std::size_t pose_bytes = std::size_t{512} << 20, measurement_bytes = pose_bytes;
constexpr int sample_poses = 2000;  // to choose samples from
constexpr float least = std::numeric_limits<float>::min();

/// What boxes lacked in some poses, in the units of their growth, and these units.
struct Measurements {
    PoseRows cluster_growth, spread;  // [poses, clusters]
    PoseRows growth;                  // [poses, 16 parts]; negative for children that are not present
    PoseRows residual;                // [poses, parts]
};

/// At most `most` of the surface's poses, evenly spread, as many as 512 MiB hold.
std::vector<Vertices> some_poses(FrameSource& source, std::span<const FrameId> frames, int most) {
    const std::size_t bytes = std::max<Eigen::Index>(3 * source.W().rows(), 1) * sizeof(float);
    const int fit = std::clamp<std::size_t>(pose_bytes / bytes, 1, 1'000'000);
    const std::vector<FrameId> chosen = spread(frames, std::min(most, fit));
    std::vector<Vertices> poses(chosen.size());
    source.for_each_frame(chosen, [&](int, int index, VerticesRef x) { poses[index] = x; });
    return poses;
}

/// The least of the numbers that at most a share `miss_rate` of them exceeds.
float upper_quantile(Eigen::VectorXf numbers, double miss_rate) {
    const auto above = static_cast<Eigen::Index>(miss_rate * static_cast<double>(numbers.size()));
    float* nth = numbers.data() + numbers.size() - 1 - std::min(above, numbers.size() - 1);
    std::nth_element(numbers.data(), nth, numbers.data() + numbers.size());
    return *nth;
}

/// Fits the growth of a box of samples so that it is too small in at most a share `miss_rate` of the poses.
/// spread, growths: of each pose. Deviations of spread^2 are at least 0.3 % of its mean, so that rounding
/// does not count as out of distribution.
BoxFit fit_box(const Eigen::VectorXf& spread, Eigen::VectorXf growths, double miss_rate) {
    const Eigen::ArrayXd squared = spread.cast<double>().array().square();
    const double mean = squared.mean(), deviation = std::sqrt((squared - mean).square().mean());
    const double least = std::max(0.003 * mean, double{std::numeric_limits<float>::min()});
    return {std::max(0.f, upper_quantile(std::move(growths), miss_rate)), static_cast<float>(mean),
            static_cast<float>(1 / std::max(deviation, least))};
}

std::vector<int> part_vertices(const WideTree& tree, int part) {
    return distinct(part < tree.clusters() ? tree.cluster_children(part)
                                           : tree.block_children(part - tree.clusters()));
}

/// Samples of each of the first `count` parts, `per_part` each; smaller parts repeat theirs.
std::vector<int> choose_part_samples(const SurfaceBody& body, std::span<const Vertices> poses,
                                     const WideTree& tree, int count, SampleRule rule, int per_part) {
    std::vector<int> samples(count * per_part);
    std::atomic<int> done = 0;
    parallel_for(
        count,
        [&](int part) {
            const std::vector<int> chosen =
                choose_samples(body.X, poses, part_vertices(tree, part), rule, per_part);
            for (int k = 0; k < per_part; ++k) samples[part * per_part + k] = chosen[k % chosen.size()];
            tell_progress("parts", ++done, count);
        },
        1);
    return samples;
}

/// A fit with samples whose other numbers are neutral.
LearnedAffineFit choose_all_samples(const SurfaceBody& body, const WideTree& tree, FrameSource& source,
                                    std::span<const FrameId> frames) {
    const int parts = tree.clusters() + tree.blocks();
    const Vertices rest[] = {body.X};
    return {.X = body.X,
            .samples = choose_part_samples(body, rest, tree, parts, SampleRule::spread,
                                           LearnedAffineFit::samples_per_part),
            .box_samples =
                choose_part_samples(body, some_poses(source, frames, sample_poses), tree, tree.clusters(),
                                    SampleRule::support, LearnedAffineFit::samples_per_box),
            .clusters = std::vector<BoxFit>(tree.clusters()),
            .residual = std::vector<float>(parts, 1.f),
            .growth = std::vector<float>(parts * tree_width)};
}

Measurements measure(const LearnedAffineModel& model, const WideTree& tree, FrameSource& source,
                     std::span<const FrameId> frames, std::uint64_t seed) {
    const Eigen::Index poses = frames.size();
    Measurements all{PoseRows(poses, model.clusters()), PoseRows(poses, model.clusters()),
                     PoseRows(poses, tree_width * model.parts()), PoseRows(poses, model.parts())};
    struct Scratch {
        Vertices turned;
        WideBoxes exact;
        BoxPack boxes;
        std::vector<float> of_map;
    };
    std::vector<Scratch> slots(frame_slots);
    source.for_each_frame(frames, [&](int slot, int index, VerticesRef x) {
        auto& [turned, exact, boxes, of_map] = slots[slot];
        of_map.resize(LearnedAffineModel::scratch);
        const FrameId& f = frames[index];
        const auto stream =
            static_cast<std::uint64_t>(f.trajectory) << 32 | static_cast<std::uint64_t>(f.frame);
        turned = x * CounterRandom(seed, stream).orientation().toRotationMatrix().cast<float>();
        fit_wide_boxes(tree, turned, exact);
        for (int c = 0; c < model.clusters(); ++c) {
            const ClusterSamples samples = model.cluster_samples(c, turned.data());
            all.spread(index, c) = samples.spread;
            all.cluster_growth(index, c) =
                outside(samples.box, exact.clusters[c]) / std::max(samples.spread, least);
        }
        for (int part = 0; part < model.parts(); ++part) {
            const float residual = model.map_children(part, turned.data(), of_map.data(), boxes);
            all.residual(index, part) = residual;
            const auto protrusions = model.protrusions(part, boxes, tree, exact);
            for (int k = 0; k < tree_width; ++k)
                all.growth(index, tree_width * part + k) = protrusions[k] / residual;
        }
    });
    return all;
}

/// As many frames as the measurements of this model may hold.
std::vector<FrameId> some_frames(const LearnedAffineModel& model, std::span<const FrameId> frames) {
    const std::size_t bytes = ((tree_width + 1) * model.parts() + 2 * model.clusters()) * sizeof(float);
    const auto fit = std::clamp<std::size_t>(measurement_bytes / bytes, 1, 1'000'000);
    return spread(frames, fit);
}

}  // namespace

void check_learned_affine_config(const LearnedAffineConfig& config) {
    if (!(config.box_miss_rate >= 0 && config.box_miss_rate < 1))
        throw std::invalid_argument(
            fmt::format("miss rate of boxes {}; allowed: [0, 1)", config.box_miss_rate));
}

std::shared_ptr<const LearnedAffineModel> train_learned_affine(
    const SurfaceBody& body, const WideTree& tree, FrameSource& source, std::span<const FrameId> frames,
    const LearnedAffineConfig& config, const std::function<void(std::string_view)>& stage) {
    check_learned_affine_config(config);
    if (frames.empty()) throw std::invalid_argument("no pose to fit learned affine bounds to");
    if (stage) stage("fitting learned affine bounds");
    LearnedAffineFit fit = choose_all_samples(body, tree, source, frames);
    const LearnedAffineModel neutral(tree, fit);
    const Measurements measured =
        measure(neutral, tree, source, some_frames(neutral, frames), counter_random(config.seed, 3, 0));
    for (int c = 0; c < neutral.clusters(); ++c)
        fit.clusters[c] =
            fit_box(measured.spread.col(c), measured.cluster_growth.col(c), config.box_miss_rate);
    for (int part = 0; part < neutral.parts(); ++part) {
        fit.residual[part] = std::max(
            least, static_cast<float>(
                       std::sqrt(measured.residual.col(part).cast<double>().array().square().mean())));
        for (int k = tree_width * part; k < tree_width * (part + 1); ++k)
            fit.growth[k] = std::max(0.f, upper_quantile(measured.growth.col(k), config.box_miss_rate));
    }
    return std::make_shared<const LearnedAffineModel>(tree, std::move(fit));
}

}  // namespace nbd

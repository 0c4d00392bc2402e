#include "apps/bench/kernels/learned_ablation.hpp"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "collision/base/counter_random.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/parallel/parallel_for.hpp"

namespace nbd {

namespace {

enum class Fit { mean, quantile, linear, network, network_quantile, network_32, network_relative };
constexpr Fit fits[] = {
    Fit::mean,       Fit::quantile,        Fit::linear, Fit::network, Fit::network_quantile,
    Fit::network_32, Fit::network_relative};

const char* name(Fit fit) {
    constexpr const char* names[] = {"mean",       "quantile",        "linear", "network", "network quantile",
                                     "network 32", "network relative"};
    return names[static_cast<int>(fit)];
}

/// The k-th smallest of n numbers, k = ceil((n + 1) (1 - miss_rate)); the largest if there are too few for
/// that rate. Split conformal prediction [Vovk05].
double conformal_quantile(Eigen::VectorXf numbers, double miss_rate) {
    const auto n = static_cast<double>(numbers.size());
    const auto k = std::min(n, std::ceil((n + 1) * (1 - miss_rate)));
    float* nth = numbers.data() + static_cast<std::ptrdiff_t>(k) - 1;
    std::nth_element(numbers.data(), nth, numbers.data() + numbers.size());
    return static_cast<double>(*nth);
}

/// Least-squares fit over the samples' distances, with a penalty that only resolves ties.
Eigen::VectorXd linear_fit(const PoseRows& distances, const Eigen::VectorXf& growth) {
    Eigen::MatrixXd A(distances.rows(), distances.cols() + 1);
    A << distances.cast<double>(), Eigen::VectorXd::Ones(distances.rows());
    Eigen::MatrixXd G = A.transpose() * A;
    G.diagonal().array() += 1e-6 * G.trace() / static_cast<double>(G.rows());
    return G.ldlt().solve(A.transpose() * growth.cast<double>());
}

/// Divides each row by its unit.
PoseRows over(const PoseRows& rows, const Eigen::VectorXf& units) {
    return rows.array().colwise() / units.array();
}

/// Measurements of one choice of samples on the three sets of frames.
struct Measured {
    SampleReach train, calibration, test;
};

/// Growth predicted by a fit to a node's training poses, for each pose of the other sets; >= 0.
struct Growth {
    Eigen::VectorXf calibration, test;
};

Growth predict(const Measured& sets, std::size_t node, Fit fit, const LearnedAblationConfig& config) {
    const auto i = static_cast<Eigen::Index>(node);
    const Eigen::VectorXf growth = sets.train.growth.col(i);
    const auto constant = [&](float value) -> Growth {
        return {Eigen::VectorXf::Constant(sets.calibration.growth.rows(), value),
                Eigen::VectorXf::Constant(sets.test.growth.rows(), value)};
    };
    if (fit == Fit::mean) return constant(growth.mean());
    if (fit == Fit::quantile)
        return constant(static_cast<float>(conformal_quantile(growth, config.miss_rate)));
    const PoseRows& distances = sets.train.samples[node];
    const auto both = [&](auto&& f) -> Growth {
        return {f(sets.calibration.samples[node]).cwiseMax(0).cwiseMin(growth.maxCoeff()),
                f(sets.test.samples[node]).cwiseMax(0).cwiseMin(growth.maxCoeff())};
    };
    if (fit == Fit::linear) {
        const Eigen::VectorXf w = linear_fit(distances, growth).cast<float>();
        return both([&](const PoseRows& d) -> Eigen::VectorXf {
            return (d * w.head(d.cols())).array() + w[d.cols()];
        });
    }
    RadiusNetworkConfig networks = config.learned.networks;
    if (fit == Fit::network_quantile) networks.quantile = 1 - config.miss_rate;
    if (fit == Fit::network_32) networks.hidden = 32;
    if (fit == Fit::network_relative) {
        const Eigen::VectorXf largest = sets.train.distance.col(i);
        const Eigen::VectorXf w =
            train_radius_network(over(distances, largest), growth.cwiseQuotient(largest), networks, node)
                .weights;
        const auto grown = [&](const SampleReach& set) -> Eigen::VectorXf {
            const Eigen::VectorXf unit = set.distance.col(i);
            return apply_radius_network(w, over(set.samples[node], unit))
                .cwiseProduct(unit)
                .cwiseMax(0)
                .cwiseMin(growth.maxCoeff());
        };
        return {grown(sets.calibration), grown(sets.test)};
    }
    const Eigen::VectorXf w = train_radius_network(distances, growth, networks, node).weights;
    return both([&](const PoseRows& d) { return apply_radius_network(w, d); });
}

/// Adds a node's results to the sums of its depth.
void add_node(const Measured& sets, const LearnedModel& model, std::size_t node, Fit fit,
              const LearnedAblationConfig& config, LearnedAblationRow& row) {
    const auto i = static_cast<Eigen::Index>(node);
    const auto needed = [&](const SampleReach& set) -> Eigen::ArrayXf {
        return set.distance.col(i) + set.growth.col(i);
    };
    const bool exact = model.nodes[node].exact;
    const Growth growth = exact ? Growth{Eigen::VectorXf::Zero(sets.calibration.growth.rows()),
                                         Eigen::VectorXf::Zero(sets.test.growth.rows())}
                                : predict(sets, node, fit, config);
    const Eigen::ArrayXf calibration = sets.calibration.distance.col(i) + growth.calibration;
    const Eigen::ArrayXf test = sets.test.distance.col(i) + growth.test, truth = sets.test.exact.col(i);
    const auto margin = static_cast<float>(
        std::max(0., conformal_quantile(needed(sets.calibration) / calibration - 1, config.miss_rate)));
    // Sphere radii are rounded up by 4 ulp; exact nodes hold by construction.
    constexpr float slack = 1 + 4 * std::numeric_limits<float>::epsilon();
    const auto missing = [&](float factor) {
        return exact ? 0. : (needed(sets.test) > test * (factor * slack)).cast<double>().mean();
    };
    row.mean_samples += model.nodes[node].sample_count;
    row.radius_error += static_cast<double>(((test - truth).abs() / truth).mean());
    row.inflation += static_cast<double>((test * (1 + margin) / truth - 1).mean());
    row.missing_bare += missing(1);
    row.nodes_missing += missing(1 + margin);
    const float box_growth = model.boxes[node].growth;
    row.box_growth += static_cast<double>((box_growth * sets.test.spread.col(i).array() / truth).mean());
    row.box_missing += (sets.test.box.col(i).array() > box_growth).cast<double>().mean();
}

/// Time per sphere, median over rounds; nodes of the depth in turn, for one pose after another.
double nanoseconds_of_spheres(const LearnedModel& model, const std::vector<int>& nodes,
                              const std::vector<Vertices>& poses) {
    std::vector<double> rounds;
    float sum = 0;
    for (int round = 0; round < 9; ++round) {
        const Stopwatch watch;
        for (const Vertices& x : poses)
            for (const int node : nodes) sum += learned_sphere(model, node, x).sphere.r;
        rounds.push_back(1e9 * watch.seconds());
    }
    if (!std::isfinite(sum)) throw std::runtime_error("a learned sphere is not finite");
    std::ranges::nth_element(rounds, rounds.begin() + 4);
    return rounds[4] / static_cast<double>(poses.size() * nodes.size());
}

/// The same samples with networks of zeros; the values do not affect the time.
LearnedModel with_networks(const LearnedModel& model) {
    LearnedModel wide = model;
    wide.network = true;
    wide.values.clear();
    for (LearnedModel::Node& node : wide.nodes) {
        const auto begin = wide.values.size();
        const float* weights = model.values.data() + node.value_begin;
        node.value_begin = static_cast<int>(begin);
        wide.values.resize(begin +
                           static_cast<std::size_t>(LearnedModel::block_size(node.sample_count, true)));
        std::copy_n(weights, node.sample_count, wide.values.begin() + static_cast<std::ptrdiff_t>(begin));
    }
    return wide;
}

struct Frames {
    std::vector<FrameId> train, calibration, test;
};

Frames split_frames(const RecordingReader& recording, const LearnedAblationConfig& config) {
    const TrainingSplit split = make_split(recording, {}, 0, counter_random(config.learned.seed, 4, 0));
    if (split.held_out_trajectories.size() < 2)
        throw std::runtime_error(fmt::format("{}: {} trajectories held out, at least 2 needed",
                                             recording.path().string(), split.held_out_trajectories.size()));
    TrainingSplit halves[2];
    for (std::size_t i = 0; i < split.held_out_trajectories.size(); ++i)
        halves[i % 2].held_out_trajectories.push_back(split.held_out_trajectories[i]);
    const int most = config.max_frames > 0 ? config.max_frames : std::numeric_limits<int>::max();
    return {spread(frames_of(recording, split, FrameSet::train), most),
            spread(frames_of(recording, halves[0], FrameSet::held_out), most),
            spread(frames_of(recording, halves[1], FrameSet::held_out), most)};
}

}  // namespace

std::vector<LearnedAblationRow> ablate_learned_bounds(const SurfaceBody& body,
                                                      const RecordingReader& recording,
                                                      const LearnedAblationConfig& config,
                                                      const std::function<void(int, int)>& progress) {
    const SphereTree tree = build_sphere_tree(body.X, body.F, {.depth = config.depth});
    const Frames frames = split_frames(recording, config);
    const std::vector<FrameId> timed = spread(frames.test, 20);
    std::vector<Vertices> poses(timed.size());
    FrameSource source(body.W, recording);
    source.for_each_frame(timed,
                          [&](int, int index, VerticesRef x) { poses[static_cast<std::size_t>(index)] = x; });
    std::vector<std::vector<int>> levels(static_cast<std::size_t>(tree.depth()) + 1);
    for (int i = 0; i < static_cast<int>(tree.nodes.size()); ++i)
        levels[static_cast<std::size_t>(tree.nodes[static_cast<std::size_t>(i)].depth)].push_back(i);

    std::vector<LearnedAblationRow> rows;
    const int total = static_cast<int>(2 * config.samples.size());
    for (const SampleRule rule : {SampleRule::spread, SampleRule::support})
        for (const int samples : config.samples) {
            if (progress) progress(static_cast<int>(rows.size() / (std::size(fits) * levels.size())), total);
            LearnedConfig learned = config.learned;
            learned.samples.rule = rule;
            learned.samples.count = samples;
            LearnedModel model = choose_samples(body, tree, source, frames.train, learned);
            const auto measure = [&](const std::vector<FrameId>& set) {
                return measure_reach(tree, model, source, set, counter_random(learned.seed, 2, 0), true);
            };
            const Measured sets{measure(frames.train), measure(frames.calibration), measure(frames.test)};
            fit_sample_reach(sets.train, learned, model);
            const LearnedModel wide = with_networks(model);
            for (const Fit fit : fits) {
                std::vector<LearnedAblationRow> node_rows(tree.nodes.size());
                parallel_for(
                    static_cast<int>(node_rows.size()),
                    [&](int i) {
                        const auto node = static_cast<std::size_t>(i);
                        add_node(sets, model, node, fit, config, node_rows[node]);
                    },
                    1);
                for (std::size_t depth = 0; depth < levels.size(); ++depth) {
                    LearnedAblationRow row{.rule = std::string(name(rule)),
                                           .samples = samples > 0 ? std::to_string(samples) : "auto",
                                           .fit = name(fit),
                                           .depth = static_cast<int>(depth)};
                    const auto count = static_cast<double>(levels[depth].size());
                    for (const int i : levels[depth]) {
                        const LearnedAblationRow& node = node_rows[static_cast<std::size_t>(i)];
                        row.mean_samples += node.mean_samples / count;
                        row.radius_error += node.radius_error / count;
                        row.inflation += node.inflation / count;
                        row.nodes_missing += node.nodes_missing / count;
                        row.missing_bare += node.missing_bare / count;
                        row.box_growth += node.box_growth / count;
                        row.box_missing += node.box_missing / count;
                    }
                    const bool network = fit == Fit::network || fit == Fit::network_quantile;
                    if (fit != Fit::network_32 && fit != Fit::network_relative)
                        row.nanoseconds =
                            nanoseconds_of_spheres(network ? wide : model, levels[depth], poses);
                    rows.push_back(row);
                }
            }
        }
    if (progress) progress(total, total);
    return rows;
}

std::string to_csv(const std::vector<LearnedAblationRow>& rows) {
    std::string text =
        "rule,samples,fit,depth,mean_samples,radius_error,inflation,nodes_missing,nodes_missing_bare,box_"
        "growth,"
        "box_missing,nanoseconds\n";
    for (const LearnedAblationRow& r : rows)
        text += fmt::format("{},{},{},{},{:.1f},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.0f}\n", r.rule,
                            r.samples, r.fit, r.depth, r.mean_samples, r.radius_error, r.inflation,
                            r.nodes_missing, r.missing_bare, r.box_growth, r.box_missing, r.nanoseconds);
    return text;
}

}  // namespace nbd

#include "training/learn/samples.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>

#include "collision/base/counter_random.hpp"
#include "collision/bounds/learned/learned_model.hpp"

namespace nbd {

namespace {

constexpr int lanes = LearnedModel::lanes;
constexpr int measures = 7;  // distance from the centre, and extent along the six sides of a box

/// A node's vertices without repeats, and the share of each in the node's list.
struct NodeVertices {
    std::vector<int> ids;
    Eigen::VectorXf share;  // weight in the mean; sum 1

    explicit NodeVertices(std::span<const int> listed) : ids(listed.begin(), listed.end()) {
        std::ranges::sort(ids);
        const std::vector<int> all = ids;
        ids.erase(std::ranges::unique(ids).begin(), ids.end());
        share.resize(static_cast<Eigen::Index>(ids.size()));
        for (std::size_t i = 0; i < ids.size(); ++i)
            share[static_cast<Eigen::Index>(i)] =
                static_cast<float>(std::ranges::equal_range(all, ids[i]).size()) /
                static_cast<float>(all.size());
    }
    int count() const noexcept { return static_cast<int>(ids.size()); }
    Eigen::RowVector3f mean(VerticesRef x) const {
        Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
        for (std::size_t i = 0; i < ids.size(); ++i)
            sum += (share[static_cast<Eigen::Index>(i)] * x.row(ids[i])).cast<double>();
        return sum.cast<float>();
    }
    float radius(const Vertices& x, const Eigen::RowVector3f& c) const {
        float squared = 0;
        for (const int v : ids) squared = std::max(squared, (x.row(v) - c).squaredNorm());
        return std::sqrt(squared);
    }
};

/// A node in one pose.
struct NodePose {
    const Vertices* x;
    Eigen::RowVector3f c;  // mean of the node's vertices
    float r;               // largest distance from it
    Eigen::Matrix3f axes;  // of a box, at random, because bodies in use turn freely

    /// Distance of the vertex from the centre and its extent along the six directions.
    std::array<float, measures> measure(int v) const {
        const Eigen::RowVector3f q = x->row(v) - c, s = q * axes;
        return {q.norm(), s[0], s[1], s[2], -s[0], -s[1], -s[2]};
    }
};

std::vector<NodePose> node_poses(const NodeVertices& node, std::span<const Vertices> poses,
                                 std::uint64_t seed) {
    std::vector<NodePose> seen;
    for (std::size_t p = 0; p < poses.size(); ++p) {
        NodePose pose{.x = &poses[p], .c = node.mean(poses[p]), .r = 0, .axes = {}};
        pose.r = std::max(node.radius(poses[p], pose.c), std::numeric_limits<float>::min());
        pose.axes = CounterRandom(seed, p).orientation().toRotationMatrix().cast<float>();
        seen.push_back(pose);
    }
    return seen;
}

/// Vertices that are farthest by some measure in some pose.
std::vector<int> farthest_vertices(const NodeVertices& node, const std::vector<NodePose>& poses) {
    std::vector<int> found;
    for (const NodePose& pose : poses) {
        std::array<float, measures> most;
        most.fill(-std::numeric_limits<float>::infinity());
        std::array<int, measures> at{};
        for (const int v : node.ids) {
            const auto m = pose.measure(v);
            for (std::size_t k = 0; k < measures; ++k)
                if (m[k] > most[k]) most[k] = m[k], at[k] = v;
        }
        found.insert(found.end(), at.begin(), at.end());
    }
    std::ranges::sort(found);
    found.erase(std::ranges::unique(found).begin(), found.end());
    return found;
}

/// At most `count` candidates, chosen greedily by what each adds to those before it; stops when none adds
/// anything.
std::vector<int> support_vertices(const NodeVertices& node, const std::vector<NodePose>& poses, int count,
                                  double side_weight) {
    const std::vector<int> candidates = farthest_vertices(node, poses);
    const auto rows = static_cast<Eigen::Index>(measures * poses.size());
    // Each candidate's measures in each pose, relative to the node's radius.
    Eigen::ArrayXXf reach(rows, static_cast<Eigen::Index>(candidates.size()));
    for (std::size_t p = 0; p < poses.size(); ++p)
        for (std::size_t i = 0; i < candidates.size(); ++i) {
            const auto m = poses[p].measure(candidates[i]);
            for (int k = 0; k < measures; ++k)
                reach(static_cast<Eigen::Index>(measures * p) + k, static_cast<Eigen::Index>(i)) =
                    m[static_cast<std::size_t>(k)] / poses[p].r *
                    (k == 0 ? 1 : static_cast<float>(side_weight));
        }
    std::vector<int> chosen;
    Eigen::ArrayXf reached = Eigen::ArrayXf::Zero(rows);
    while (static_cast<int>(chosen.size()) < count) {
        const Eigen::ArrayXf gain = (reach.colwise() - reached).max(0.f).colwise().sum().transpose();
        Eigen::Index best = 0;
        if (!(gain.maxCoeff(&best) > 0)) break;
        chosen.push_back(candidates[static_cast<std::size_t>(best)]);
        reached = reached.max(reach.col(best));
    }
    return chosen;
}

/// Adds vertices far from those chosen, at rest, until there are `count` or all.
void add_spread_vertices(VerticesRef X, const NodeVertices& node, int count, std::vector<int>& chosen) {
    const auto far = [&](const Eigen::RowVector3f& point) {
        Eigen::ArrayXf squared(node.count());
        for (int i = 0; i < node.count(); ++i)
            squared[i] = (X.row(node.ids[static_cast<std::size_t>(i)]) - point).squaredNorm();
        return squared;
    };
    Eigen::Index at = 0;
    if (chosen.empty()) {
        far(node.mean(X)).maxCoeff(&at);
        chosen.push_back(node.ids[static_cast<std::size_t>(at)]);
    }
    Eigen::ArrayXf squared = far(X.row(chosen.front()));
    for (const int v : chosen) squared = squared.min(far(X.row(v)));
    while (static_cast<int>(chosen.size()) < std::min(count, node.count())) {
        squared.maxCoeff(&at);
        chosen.push_back(node.ids[static_cast<std::size_t>(at)]);
        squared = squared.min(far(X.row(chosen.back())));
        squared[at] = -1;  // vertices may coincide
    }
}

/// The weights w, sum 1, that minimize |sum of w x - mean|^2 over the poses. A small penalty on their squares
/// keeps the centre stable where the poses do not distinguish samples.
Eigen::VectorXd centre_weights(const std::vector<NodePose>& poses, const std::vector<int>& samples) {
    constexpr double ridge = 1e-4;
    const auto k = static_cast<Eigen::Index>(samples.size());
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(k, k);
    Eigen::MatrixX3d offsets(k, 3);
    for (const NodePose& pose : poses) {
        for (Eigen::Index i = 0; i < k; ++i)
            offsets.row(i) = (pose.x->row(samples[static_cast<std::size_t>(i)]) - pose.c).cast<double>();
        G.selfadjointView<Eigen::Lower>().rankUpdate(offsets);
    }
    const double scale = std::max(G.trace() / static_cast<double>(k), std::numeric_limits<double>::min());
    G.diagonal().array() += ridge * scale;
    const Eigen::VectorXd w = G.selfadjointView<Eigen::Lower>().llt().solve(Eigen::VectorXd::Ones(k));
    return w / w.sum();
}

/// Mean relative radius error over the poses if the vertices' reach beyond the samples is taken as constant.
double radius_error(const std::vector<NodePose>& poses, const std::vector<int>& samples,
                    const Eigen::VectorXd& weights) {
    Eigen::ArrayXd distance(static_cast<Eigen::Index>(poses.size())), exact(distance);
    for (std::size_t p = 0; p < poses.size(); ++p) {
        const NodePose& pose = poses[p];
        Eigen::RowVector3d c = Eigen::RowVector3d::Zero();
        for (std::size_t i = 0; i < samples.size(); ++i)
            c += weights[static_cast<Eigen::Index>(i)] * pose.x->row(samples[i]).cast<double>();
        double squared = 0;
        for (const int v : samples)
            squared = std::max(squared, (pose.x->row(v).cast<double>() - c).squaredNorm());
        distance[static_cast<Eigen::Index>(p)] = std::sqrt(squared);
        exact[static_cast<Eigen::Index>(p)] = static_cast<double>(pose.r);
    }
    const double growth = (exact - distance).mean();
    return ((distance + growth - exact).abs() / exact).mean();
}

/// The node's samples, padded to a multiple of 16 with the first sample at weight 0.
NodeSamples grouped(const std::vector<int>& vertices, const Eigen::VectorXf& weights, bool exact) {
    NodeSamples samples{.vertices = vertices, .weights = weights, .exact = exact};
    const auto count = (samples.vertices.size() + lanes - 1) / lanes * lanes;
    samples.vertices.resize(count, vertices.front());
    samples.weights.conservativeResizeLike(Eigen::VectorXf::Zero(static_cast<Eigen::Index>(count)));
    return samples;
}

}  // namespace

std::string_view name(SampleRule rule) noexcept { return rule == SampleRule::spread ? "spread" : "support"; }

void check_samples_config(const SamplesConfig& c) {
    const auto require = [](bool ok, const char* what, auto value, const char* allowed) {
        if (!ok) throw std::invalid_argument(fmt::format("{} {}; allowed: {}", what, value, allowed));
    };
    constexpr int most = LearnedModel::max_samples;
    require(c.count >= 0 && c.count <= most && c.count % lanes == 0, "samples of a node:", c.count,
            "0 or a multiple of 16 up to 128");
    require(c.max_count >= lanes && c.max_count <= most && c.max_count % lanes == 0,
            "maximum samples of a node:", c.max_count, "a multiple of 16 up to 128");
    require(c.tolerance >= 0, "tolerance of the samples", c.tolerance, "0 or more");
    require(c.exact_vertices >= lanes && c.exact_vertices <= most,
            "maximum vertices of an exact node:", c.exact_vertices, "16 to 128");
    require(c.spread_share >= 0 && c.spread_share <= 1, "share of spread samples", c.spread_share, "[0, 1]");
    require(c.side_weight >= 0, "weight of a box's side", c.side_weight, "0 or more");
}

NodeSamples choose_samples(VerticesRef X, std::span<const Vertices> poses, std::span<const int> vertices,
                           const SamplesConfig& config) {
    const NodeVertices node(vertices);
    if (node.count() <= config.exact_vertices) return grouped(node.ids, node.share, true);
    const std::vector<NodePose> seen = node_poses(node, poses, config.seed);
    const int most = config.count > 0 ? config.count : config.max_count;
    std::vector<int> support;
    const auto supported = [&](int count) {
        return count - static_cast<int>(config.spread_share * static_cast<double>(count));
    };
    if (config.rule == SampleRule::support)
        support = support_vertices(node, seen, supported(most), config.side_weight);
    for (int count = config.count > 0 ? config.count : lanes;; count += lanes) {
        if (count >= node.count()) return grouped(node.ids, node.share, true);
        const auto first = std::min(support.size(), static_cast<std::size_t>(supported(count)));
        std::vector<int> chosen(support.begin(), support.begin() + static_cast<std::ptrdiff_t>(first));
        add_spread_vertices(X, node, count, chosen);
        const Eigen::VectorXd weights = centre_weights(seen, chosen);
        if (count >= most || radius_error(seen, chosen, weights) <= config.tolerance)
            return grouped(chosen, weights.cast<float>(), false);
    }
}

}  // namespace nbd

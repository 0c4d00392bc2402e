#include "training/learn/k_means.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "collision/base/counter_random.hpp"
#include "meshing/parallel/parallel_for.hpp"

namespace nbd {

namespace {

constexpr Eigen::Index block_rows = 256;  // points per task and matrix product

/// Calls body(first, count) for consecutive blocks of `n` rows, in parallel.
template <class F>
void for_blocks(Eigen::Index n, F&& body) {
    parallel_for((n + block_rows - 1) / block_rows,
                 [&](int b) {
                     const Eigen::Index first = b * block_rows;
                     body(first, std::min(block_rows, n - first));
                 },
                 1);
}

/// k-means++: picks each centroid among the points with a probability proportional to its squared distance
/// from the nearest centroid picked so far.
PointRows seed_centroids(PointRowsRef points, int k, std::uint64_t seed, std::uint64_t stream) {
    const Eigen::Index limit = Eigen::Index{32} * k;
    const Eigen::Index stride = std::max<Eigen::Index>(1, points.rows() / limit);
    const Eigen::Index candidates = (points.rows() + stride - 1) / stride;
    Eigen::VectorXf distance = Eigen::VectorXf::Constant(candidates, std::numeric_limits<float>::max());
    PointRows centroids(k, points.cols());
    Eigen::Index pick = counter_index(seed, stream, 0, candidates);
    for (int c = 0;; ++c) {
        centroids.row(c) = points.row(pick * stride);
        if (c + 1 == k) return centroids;
        for_blocks(candidates, [&](Eigen::Index first, Eigen::Index count) {
            for (Eigen::Index i = first; i < first + count; ++i)
                distance[i] =
                    std::min(distance[i], (points.row(i * stride) - centroids.row(c)).squaredNorm());
        });
        const double total = std::accumulate(distance.begin(), distance.end(), 0.0);
        double rest = total * counter_uniform(seed, stream, c + 1);
        // Picks the first point whose share is reached, or the last with a distance above 0 if rounding runs
        // past the end.
        for (Eigen::Index i = 0; i < candidates && rest >= 0; ++i)
            if (distance[i] > 0) {
                pick = i;
                rest -= static_cast<double>(distance[i]);
            }
    }
}

/// One point of every `stride`, drawn at random.
PointRows draw_points(PointRowsRef points, Eigen::Index stride, std::uint64_t seed) {
    constexpr std::uint64_t stream = 1 << 20;  // above all initialisations
    PointRows drawn(points.rows() / stride, points.cols());
    for (Eigen::Index i = 0; i < drawn.rows(); ++i)
        drawn.row(i) = points.row(i * stride + counter_index(seed, stream, i, stride));
    return drawn;
}

/// Nearest centroid of every point, ties to the lowest number, and its squared distance.
void assign(PointRowsRef points, const PointRows& centroids, std::vector<int>& label,
            Eigen::VectorXf& distance) {
    const Eigen::RowVectorXf half = 0.5f * centroids.rowwise().squaredNorm().transpose();
    for_blocks(points.rows(), [&](Eigen::Index first, Eigen::Index count) {
        // |p - c|^2 / 2 less |p|^2 / 2, which is the same for all centroids.
        PointRows score = half.replicate(count, 1);
        score.noalias() -= points.middleRows(first, count) * centroids.transpose();
        for (Eigen::Index i = 0; i < count; ++i) {
            Eigen::Index nearest = 0;
            score.row(i).minCoeff(&nearest);
            label[first + i] = nearest;
            distance[first + i] = (points.row(first + i) - centroids.row(nearest)).squaredNorm();
        }
    });
}

/// Gives every empty cluster the point farthest from its centroid.
void refill(const std::vector<int>& count, std::vector<int>& label, Eigen::VectorXf& distance) {
    for (std::size_t c = 0; c < count.size(); ++c) {
        if (count[c] > 0) continue;
        Eigen::Index farthest = 0;
        if (!(distance.maxCoeff(&farthest) > 0)) return;  // every point sits on a centroid
        label[farthest] = c;
        distance[farthest] = 0;
    }
}

std::vector<int> cluster_sizes(const std::vector<int>& label, int k) {
    std::vector<int> size(k, 0);
    for (const int c : label) ++size[c];
    return size;
}

/// Gives every point to its nearest centroid and every centroid at least one point. Returns the inertia.
double assign_all(PointRowsRef points, const PointRows& centroids, std::vector<int>& label,
                  Eigen::VectorXf& distance) {
    assign(points, centroids, label, distance);
    refill(cluster_sizes(label, centroids.rows()), label, distance);
    return std::accumulate(distance.begin(), distance.end(), 0.0);
}

/// Members of each cluster in ascending order.
std::vector<std::vector<int>> members(const std::vector<int>& label, int k) {
    std::vector<std::vector<int>> list(k);
    for (std::size_t i = 0; i < label.size(); ++i) list[label[i]].push_back(i);
    return list;
}

/// Moves each centroid to the mean of its members; clusters without members keep theirs.
void move_centroids(PointRowsRef points, const std::vector<int>& label, PointRows& centroids) {
    const int k = centroids.rows();
    const auto list = members(label, k);
    parallel_for(
        k,
        [&](int c) {
            const std::vector<int>& own = list[c];
            if (own.empty()) return;
            Eigen::RowVectorXf sum = Eigen::RowVectorXf::Zero(points.cols());
            for (const int i : own) sum += points.row(i);
            centroids.row(c) = sum / static_cast<float>(own.size());
        },
        1);
}

/// Drops empty clusters, renumbers the others from 0 and finds their representatives.
void represent(PointRowsRef points, const PointRows& centroids, Clustering& result) {
    const auto list = members(result.label, centroids.rows());
    std::vector<float> sizes;
    for (std::size_t c = 0; c < list.size(); ++c) {
        if (list[c].empty()) continue;
        const auto row = centroids.row(c);
        float nearest = std::numeric_limits<float>::max();
        int representative = list[c].front();
        for (const int i : list[c]) {
            result.label[i] = sizes.size();
            const float d = (points.row(i) - row).squaredNorm();
            if (d < nearest) nearest = d, representative = i;
        }
        result.representatives.push_back(representative);
        sizes.push_back(static_cast<float>(list[c].size()));
    }
    result.sizes = Eigen::Map<const Eigen::VectorXf>(sizes.data(), sizes.size());
}

/// Lloyd's iterations over all of these points. Sets everything but the representatives and sizes.
void iterate(PointRowsRef points, const KMeansConfig& config, PointRows& centroids, Clustering& result) {
    result.label.resize(points.rows());
    Eigen::VectorXf distance(points.rows());
    double last = std::numeric_limits<double>::infinity();
    while (result.iterations < config.max_iterations) {
        ++result.iterations;
        result.inertia = assign_all(points, centroids, result.label, distance);
        if (!(result.inertia < last * (1 - config.improvement))) break;
        last = result.inertia;
        move_centroids(points, result.label, centroids);
    }
}

}  // namespace

Clustering k_means(PointRowsRef points, const KMeansConfig& config, std::uint64_t initialisation) {
    const Eigen::Index n = points.rows();
    if (n < 1) throw std::invalid_argument("no points to cluster");
    if (config.clusters < 1)
        throw std::invalid_argument(fmt::format("{} clusters, at least 1 needed", config.clusters));
    if (config.max_iterations < 1)
        throw std::invalid_argument(
            fmt::format("{} iterations of k-means, at least 1 needed", config.max_iterations));
    if (config.points_per_cluster < 1)
        throw std::invalid_argument(
            fmt::format("{} points per cluster, at least 1 needed", config.points_per_cluster));
    const int k = std::min<Eigen::Index>(config.clusters, n);

    Clustering result;
    PointRows centroids = seed_centroids(points, k, config.seed, initialisation);
    const Eigen::Index stride = n / (Eigen::Index{config.points_per_cluster} * k);
    if (stride < 2) {
        iterate(points, config, centroids, result);
    } else {
        iterate(draw_points(points, stride, config.seed), config, centroids, result);
        result.label.resize(n);
        Eigen::VectorXf distance(n);
        result.inertia = assign_all(points, centroids, result.label, distance);
    }
    represent(points, centroids, result);
    return result;
}

}  // namespace nbd

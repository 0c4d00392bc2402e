#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace nbd {

/// Points to cluster, one per row.
using PointRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using PointRowsRef = Eigen::Ref<const PointRows>;

struct KMeansConfig {
    int clusters = 512;         // at most the number of points is used
    int max_iterations = 50;    // stops earlier once the inertia falls by less than `improvement`
    double improvement = 1e-4;  // relative
    /// Of a larger set, one point of every two or more moves the centroids, at least so many per cluster;
    /// then all points are assigned.
    int points_per_cluster = 128;
    std::uint64_t seed = 1;
};

struct Clustering {
    std::vector<int> label;            // [n] cluster of each point
    std::vector<int> representatives;  // [k] member nearest to the cluster's centroid; all different
    Eigen::VectorXf sizes;             // [k] members, >= 1
    double inertia = 0;                // sum of squared distances of all points to the centroids
    int iterations = 0;
};

/// Lloyd's k-means in the L2 metric, seeded by k-means++ among an even subset of 32 to 64 points per
/// cluster. An empty cluster moves to the point farthest from its centroid; if it stays empty because points
/// coincide, it is dropped. points: [n, d], n >= 1. initialisation: number of the run, selects its random
/// numbers. Same bits on any number of threads. Throws std::invalid_argument on an empty set or a config out
/// of range.
Clustering k_means(PointRowsRef points, const KMeansConfig& config, std::uint64_t initialisation);

}  // namespace nbd

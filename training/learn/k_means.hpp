#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace nbd {

/// Points to cluster, one row each.
using PointRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using PointRowsRef = Eigen::Ref<const PointRows>;

struct KMeansConfig {
    int clusters = 512;         // at most as many as there are points are used
    int max_iterations = 50;    // ends earlier once the inertia falls by less than `improvement`
    double improvement = 1e-4;  // relative
    std::uint64_t seed = 1;
};

struct Clustering {
    std::vector<int> label;            // [n] cluster of each point
    std::vector<int> representatives;  // [k] the member nearest to its cluster's centroid; all different
    Eigen::VectorXf sizes;             // [k] members, >= 1
    double inertia = 0;                // sum of squared distances to the centroids
    int iterations = 0;
};

/// Lloyd's k-means in the L2 metric, seeded by k-means++ (among an even subset of 32 points a cluster, where
/// there are more). A cluster that runs empty moves to the point farthest from its centroid; where points
/// coincide so that one stays empty it is dropped. points: [n, d], n >= 1. initialisation: the number of the
/// run, tells its random numbers from those of other runs. Same bits on any number of threads.
/// Throws std::invalid_argument on an empty set or a config out of range.
Clustering k_means(PointRowsRef points, const KMeansConfig& config, std::uint64_t initialisation);

}  // namespace nbd

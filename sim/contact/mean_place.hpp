#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace nbd {

/// Where forces act: the mean of their places, weighted with their sizes.
class MeanPlace {
 public:
    void add(const Eigen::Vector3d& place, double size) {
        // Places of forces that are all zero count alike.
        constexpr double least = 1e-200;
        const double weight = std::max(size, least);
        sum_ += weight * place;
        weight_ += weight;
    }
    /// Adds the places of other forces, each `factor` times its size, > 0.
    void add(const MeanPlace& other, double factor) {
        sum_ += factor * other.sum_;
        weight_ += factor * other.weight_;
    }
    /// Zero where no force acts.
    Eigen::Vector3d mean() const {
        return weight_ > 0 ? Eigen::Vector3d(sum_ / weight_) : Eigen::Vector3d::Zero();
    }

 private:
    Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();
    double weight_ = 0;
};

}  // namespace nbd

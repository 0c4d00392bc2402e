#pragma once

#include <Eigen/Core>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "sim/factor/packed_factor.hpp"
#include "sim/fem/elastic_body.hpp"

namespace nbd {

/// The step's matrix in the rest pose, factorised once: with each node's rotation around it, it stands in for
/// the matrix of any pose, as warping the stiffness does [MuellerGross04]. What it leaves out: elements that
/// are turned otherwise than the nodes at their corners.
class RestFactor {
 public:
    /// Of mass_scale M + stiffness_scale K(rest), rows and columns of prescribed nodes being the identity's.
    /// prescribed: [N], not 0 for these.
    RestFactor(const ElasticBody& body, double mass_scale, double stiffness_scale,
               const std::vector<char>& prescribed);

    /// z = T A_rest^-1 T^T r, T the nodes' rotations. r, z: [3 N]; may be the same. work: scratch.
    void apply(const NodeRotations& rotations, const double* r, double* z, std::vector<float>& y,
               std::vector<float>& work) const;

    std::size_t bytes() const noexcept { return factor_.bytes(); }

 private:
    PackedFactor factor_;
};

/// The rest factors of all bodies, time steps and sets of prescribed nodes that a program needs, each made
/// once. Any number of threads may ask at once. Bodies must outlive it.
class RestFactors {
 public:
    /// Throws std::runtime_error where the factorisation fails.
    std::shared_ptr<const RestFactor> get(const ElasticBody& body, double mass_scale, double stiffness_scale,
                                          const std::vector<char>& prescribed);

 private:
    struct Entry {
        const ElasticBody* body;
        double mass_scale, stiffness_scale;
        std::vector<char> prescribed;
        std::shared_ptr<const RestFactor> factor;
    };
    std::mutex mutex_;
    std::vector<Entry> entries_;
};

}  // namespace nbd

#pragma once

#include <Eigen/Core>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "sim/factor/packed_factor.hpp"
#include "sim/fem/elastic_body.hpp"

namespace nbd {

/// Factor of the step's matrix in the rest pose. With a rotation at each node it approximates the matrix of
/// any pose, as stiffness warping does [MuellerGross04]. It neglects that elements may be rotated differently
/// from the nodes at their corners.
class RestFactor {
 public:
    /// Factorises mass_scale M + stiffness_scale K(rest), with rows and columns of prescribed nodes replaced
    /// by the identity. prescribed: [N], non-zero for these nodes.
    RestFactor(const ElasticBody& body, double mass_scale, double stiffness_scale,
               const std::vector<char>& prescribed);

    /// z = T A_rest^-1 T^T r, where T are the rotations of the nodes. r, z: [3 N], may be the same. y, work:
    /// scratch.
    void apply(const NodeRotations& rotations, const double* r, double* z, std::vector<float>& y,
               std::vector<float>& work) const;

    std::size_t bytes() const noexcept { return factor_.bytes(); }

 private:
    PackedFactor factor_;
};

/// Cache of rest factors by body, time step and set of prescribed nodes. Thread-safe. Bodies must outlive it.
class RestFactors {
 public:
    /// Throws std::runtime_error if the factorisation fails.
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

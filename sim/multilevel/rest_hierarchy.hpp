#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "sim/fem/elastic_body.hpp"
#include "sim/multilevel/block_sparse.hpp"

namespace nbd {

/// Interpolation from the aggregates of a coarser level, and its transpose.
template <int B>
struct Transfer {
    TransferMatrix<B, 6> prolongation;
    TransferMatrix<6, B> restriction;
};

/// A level of aggregates with six unknowns each, the shares of their rigid motions.
struct RestLevel {
    LevelMatrix<6> A;                                   // blocks off the diagonal
    std::vector<Eigen::Matrix<double, 6, 6>> diagonal;  // the others, not rounded
    BlockSparse<6, 6> to_factorize{};                   // all of them, of small levels and of the last
    Transfer<6> coarser{};                              // from the next level; empty at the coarsest
};

/// Coarser and coarser versions of a step's matrix in the rest pose, by smoothed aggregation [Vanek96]: the
/// rigid motions of groups of nodes, smoothed once. With a rotation at each node they approximate the
/// coarser versions of the matrix of any pose, as stiffness warping does [MuellerGross04].
struct RestHierarchy {
    static constexpr int coarse_enough = 48;  // aggregates of a body that are solved directly

    /// Coarsens mass_scale M + stiffness_scale K(rest), with rows and columns of prescribed nodes replaced
    /// by the identity. prescribed: [N], non-zero for these nodes.
    RestHierarchy(const ElasticBody& body, double mass_scale, double stiffness_scale,
                  const std::vector<char>& prescribed);

    /// Number of levels down to the first one of at most so many aggregates, or else of all levels.
    std::size_t depth(int aggregates) const;

    Transfer<3> fine;               // from the first level to the nodes, in the rest frame
    std::vector<RestLevel> levels;  // at least one, finest first
};

/// Cache of hierarchies by body, time step and set of prescribed nodes. Thread-safe. Bodies need not outlive
/// it; the hierarchies of those that are gone are dropped.
class RestHierarchies {
 public:
    std::shared_ptr<const RestHierarchy> get(const ElasticBody& body, double mass_scale,
                                             double stiffness_scale, const std::vector<char>& prescribed);

 private:
    struct Entry {
        double mass_scale, stiffness_scale;
        std::vector<char> prescribed;
        std::shared_ptr<const RestHierarchy> hierarchy;
    };
    std::mutex mutex_;
    std::map<std::weak_ptr<const ElasticBody::Identity>, std::vector<Entry>, std::owner_less<>>
        entries_;  // oldest first
};

}  // namespace nbd

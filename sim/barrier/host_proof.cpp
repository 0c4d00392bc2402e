#include "sim/barrier/host_proof.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/barrier/least_stretch.hpp"

namespace nbd {
namespace {

/// Whether faces with this ratio keep apart.
bool keeps_apart(double stretch, double difference, double ratio) noexcept {
    return stretch - difference * ratio >= HostProof::least_share;
}

}  // namespace

HostProof::HostProof(std::shared_ptr<const HostNeighbours> rest)
    : rest_(std::move(rest)),
      stretches_(rest_->hosts().size()),
      differences_(rest_->hosts().size()),
      residuals_(rest_->hosts().size()) {}

/// Gradients and residuals change evenly in the motion, so that the largest are at its ends.
void HostProof::measure(int h, const Nodes& begin, const Nodes& end) {
    const HostNeighbours::Host& host = rest_->hosts()[h];
    const auto gradient = [&](const Nodes& x) -> Eigen::Matrix3d {
        Eigen::Matrix3d edges;
        for (int k = 0; k < 3; ++k)
            edges.col(k) = (x.row(host.nodes[k + 1]) - x.row(host.nodes[0])).transpose();
        return edges * host.inverse_edges;
    };
    const Eigen::Matrix3d at_begin = gradient(begin), at_end = gradient(end);
    stretches_[h] = least_stretch(at_begin, at_end);
    const Nodes& rest = rest_->nodes();
    const int origin = host.nodes[0];
    std::vector<double>& residuals = residuals_[h];
    residuals.resize(host.others.size());
    differences_[h] = 0;
    for (std::size_t i = 0; i < residuals.size(); ++i) {
        const int node = host.others[i];
        const Eigen::Vector3d X = (rest.row(node) - rest.row(origin)).transpose();
        const auto squared = [&](const Nodes& x, const Eigen::Matrix3d& F) {
            return ((x.row(node) - x.row(origin)).transpose() - F * X).squaredNorm();
        };
        const double a = squared(begin, at_begin), b = squared(end, at_end);
        residuals[i] = a + b < HostNeighbours::unknown ? std::sqrt(std::max(a, b)) / host.distances[i]
                                                       : HostNeighbours::unknown;
        differences_[h] = std::max(differences_[h], residuals[i]);
    }
}

void HostProof::prove(const Nodes& begin, const Nodes& end) {
    const int count = rest_->hosts().size();
    parallel_for(
        count, [&](int h) { measure(h, begin, end); }, 64);
    open_leaves_.clear();
    open_faces_.clear();
    rest_->contained().prove(begin, end, least_share, open_leaves_);
    for (const LeafPair& pair : open_leaves_) rest_->add_neighbours(pair, open_faces_);
    for (int h = 0; h < count; ++h)
        for (const HostNeighbours::Group& group : rest_->groups(h)) {
            if (keeps_apart(stretches_[h], differences_[h], group.ratio)) break;  // and so do all that follow
            double most = 0;
            for (const int other : group.others) most = std::max(most, residuals_[h][other]);
            add_open(group, stretches_[h], most);
        }
    for (const HostNeighbours::Group& group : rest_->unknown_groups())
        add_open(group, 0, HostNeighbours::unknown);
}

void HostProof::add_open(const HostNeighbours::Group& group, double stretch, double difference) {
    if (group.leaves && !keeps_apart(stretch, difference, HostNeighbours::common_ratio)) {
        open_leaves_.push_back(*group.leaves);
        return;
    }
    for (const auto& [faces, ratio] : group.faces) {
        if (keeps_apart(stretch, difference, ratio)) return;  // and so do all that follow
        open_faces_.push_back(faces);
    }
}

}  // namespace nbd

#include "sim/barrier/host_proof.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

/// The least singular value.
double least_stretch(const Eigen::Matrix3d& F) {
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(F.transpose() * F, Eigen::EigenvaluesOnly);
    constexpr double rounding = 1e-6;  // of the least root, by the largest
    return std::sqrt(std::max(solver.eigenvalues()[0], 0.0)) - rounding * std::sqrt(solver.eigenvalues()[2]);
}

}  // namespace

HostProof::HostProof(std::shared_ptr<const HostNeighbours> rest)
    : rest_(std::move(rest)),
      at_begin_(rest_->hosts().size()),
      at_end_(rest_->hosts().size()),
      stretches_(rest_->hosts().size()),
      differences_(rest_->hosts().size()) {}

/// The most by which two gradients differ in the motion: they change evenly, so that it is at an end.
double HostProof::difference(int host, int other) const noexcept {
    const double begin = (at_begin_[other] - at_begin_[host]).squaredNorm(),
                 end = (at_end_[other] - at_end_[host]).squaredNorm();
    return begin + end < std::numeric_limits<double>::infinity() ? std::sqrt(std::max(begin, end))
                                                                 : HostNeighbours::unknown;
}

template <class Hosts>
double HostProof::most_difference(int host, const Hosts& others) const noexcept {
    double most = 0;
    for (const int other : others) most = std::max(most, difference(host, other));
    return most;
}

void HostProof::prove(const Nodes& begin, const Nodes& end) {
    const int count = rest_->hosts().size();
    parallel_for(count, [&](int h) {
        const HostNeighbours::Host& host = rest_->hosts()[h];
        const auto gradient = [&](const Nodes& x) -> Eigen::Matrix3d {
            Eigen::Matrix3d edges;
            for (int k = 0; k < 3; ++k)
                edges.col(k) = (x.row(host.nodes[k + 1]) - x.row(host.nodes[0])).transpose();
            return edges * host.inverse_edges;
        };
        at_begin_[h] = gradient(begin);
        at_end_[h] = gradient(end);
        const double change = (at_end_[h] - at_begin_[h]).norm();
        stretches_[h] = (least_stretch(at_begin_[h]) + least_stretch(at_end_[h]) - change) / 2;
    });
    parallel_for(count, [&](int h) { differences_[h] = most_difference(h, rest_->hosts()[h].related); });
    open_leaves_.clear();
    open_faces_.clear();
    for (const HostNeighbours::NearLeaves& near : rest_->unknown_leaves())
        open_leaves_.push_back(near.leaves);
    for (int h = 0; h < count; ++h)
        for (const HostNeighbours::NearLeaves& near : rest_->near_leaves(h)) {
            if (keeps_apart(stretches_[h], differences_[h], near.ratio)) break;  // and so do all that follow
            const double most = most_difference(h, near.others);
            if (!keeps_apart(stretches_[h], most, HostNeighbours::common_ratio)) {
                open_leaves_.push_back(near.leaves);
                continue;
            }
            add_open(h, most, near.faces);
        }
    for (int h = 0; h < count; ++h) add_open(h, differences_[h], rest_->near_faces(h));
    for (const HostNeighbours::NearFaces& near : rest_->unknown_faces()) open_faces_.push_back(near.faces);
}

/// Of faces by falling ratios, adds those that may not keep apart. most: an upper bound of the differences.
void HostProof::add_open(int host, double most, std::span<const HostNeighbours::NearFaces> near) {
    for (const auto& [faces, ratio] : near) {
        if (keeps_apart(stretches_[host], most, ratio)) return;  // and so do all that follow
        const HostsOfFaces hosts(*rest_, rest_->face(faces.a), rest_->face(faces.b));
        // The way to a host that does not touch this one goes over others: `most` alone bounds these.
        if (!hosts.all_touch(*rest_, host) ||
            !keeps_apart(stretches_[host], most_difference(host, hosts), ratio))
            open_faces_.push_back(faces);
    }
}

bool HostProof::hang_on_one_host(FacePair faces) const {
    const HostsOfFaces hosts(*rest_, rest_->face(faces.a), rest_->face(faces.b));
    return hosts.size() == 1 && *hosts.begin() != HostNeighbours::none;
}

}  // namespace nbd

#include "sim/world/reactions.hpp"

namespace nbd {

void ReactionSums::add(int body, ReactionBy by, int number, const Eigen::Vector3d& force,
                       const Eigen::Vector3d& torque, const MeanPlace& place) {
    auto& [sum, places] = sums_[{body, static_cast<int>(by), number}];
    sum.body = body;
    sum.by = by;
    sum.number = number;
    sum.force += force;
    sum.torque += torque;
    places.add(place, 1);
}

std::vector<Reaction> ReactionSums::all() const {
    std::vector<Reaction> reactions;
    for (const auto& [key, sum] : sums_) {
        reactions.push_back(sum.reaction);
        reactions.back().point = sum.place.mean();
    }
    return reactions;
}

}  // namespace nbd

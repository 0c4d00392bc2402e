#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <vector>

#include "sim/contact/mean_place.hpp"

namespace nbd {

/// What exerts a force on a body.
enum class ReactionBy {
    grip,      // pins among them
    driven,    // what drives nodes, see World::drive()
    obstacle,  // by contact and friction
    body,      // likewise, another body
    joint,     // see World::add_joint()
    cavity,    // pressure in it, which sums to no force on its body
    wind,      // air past it
};

/// A force on a body, a mean over a step: its impulses in the step, over the length of the step. In a step of
/// second order these are what the support or the contact adds to the motion in this step; what elasticity
/// still makes of it in the next ones is not theirs. So the reactions on a body, its weight and its outer
/// forces, times the length of the step, sum to its change of momentum in every step, but for damping by
/// mass. Torques do so for its angular momentum where nothing holds it; where something does, as exactly as
/// steps are: at rest, and in motion to their second order.
struct Reaction {
    int body = 0;  // on which it acts
    ReactionBy by = ReactionBy::grip;
    int number = 0;  // of the grip, cavity or load among those of the body, of the obstacle, of the other
                     // body, or of the joint
    Eigen::Vector3d force = Eigen::Vector3d::Zero();   // N
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();  // about the origin, N m
    // Where it acts: the mean of the places of its forces, weighted with their sizes, metres; zero of a
    // cavity.
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    double pressure = 0, volume = 0;  // of a cavity at the end of the step, Pa and m3
};

/// The reactions of a step, as its parts add them.
class ReactionSums {
 public:
    /// place: where the force acts; none of a cavity.
    void add(int body, ReactionBy by, int number, const Eigen::Vector3d& force, const Eigen::Vector3d& torque,
             const MeanPlace& place);
    void clear() { sums_.clear(); }
    /// By body, then as ReactionBy, then by number.
    std::vector<Reaction> all() const;

 private:
    struct Sum {
        Reaction reaction;
        MeanPlace place;
    };
    std::map<std::array<int, 3>, Sum> sums_;
};

}  // namespace nbd

#pragma once

#include <vector>

#include "sim/scene/scene.hpp"

namespace nbd {

/// Compares what contact forces say with what bodies do: the momentum that a body gains in a step against the
/// impulse of gravity and of the contact forces on it. Bodies with grips or pins, or with damping by mass,
/// are left out.
class MomentumBalance {
 public:
    MomentumBalance(const SceneSpec& spec, const World& world);

    /// Call after every step of dt seconds.
    void add_step(const World& world, double dt);

    /// Largest difference in a step, as a share of the largest momentum that the body's nodes had.
    double error() const;
    /// Whether there is a body to compare.
    bool applies() const noexcept { return !bodies_.empty(); }

 private:
    struct Body {
        int number;
        Eigen::Vector3d momentum;  // at the end of the last step, kg m/s
        double largest;            // sum over the nodes of mass times speed, kg m/s
        double difference;         // largest of a step, kg m/s
    };
    Eigen::Vector3d gravity_;
    std::vector<Body> bodies_;
};

}  // namespace nbd

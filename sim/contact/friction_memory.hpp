#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <span>
#include <vector>

#include "sim/contact/contact.hpp"

namespace nbd {

/// How far friction has drawn the points of contacts that hold. Flat arrays of equal length, so that a file
/// can store them.
struct FrictionStretches {
    /// What a contact is known by, each once: a body with one or two of its vertices, and the other body with
    /// as many or -1 - obstacle; -1 where there is no vertex.
    std::vector<std::array<int, 6>> contacts;
    std::vector<Eigen::Vector3d> ways;  // of the first body's point, metres
};

/// A contact after a step.
struct RubbedContact {
    const Contact& contact;
    Eigen::Vector3d slid = Eigen::Vector3d::Zero();  // way of point a relative to b along the surfaces, m
    double pressed = 0;                              // normal impulse, N s
};

/// Lets friction hold what rests. A contact resists like a spring to how far its points have slid along each
/// other since they met, with mu times the normal force at Contact::slip_length; beyond it slides, and the
/// spring stays stretched by that length. So what friction holds does not creep [CundallStrack79].
///
/// A vertex keeps its spring from face to face of the other body, and two edges as long as they cross.
class FrictionMemory {
 public:
    /// Puts into a contact of a step what was known of it at the start of the step.
    /// slip_length: metres, > 0.
    void recall(Contact& contact, double slip_length) const;

    /// Replaces what is known by the contacts of a step, at its end. Those that did not press are forgotten.
    void remember(std::span<const RubbedContact> contacts);

    FrictionStretches stretches() const;
    void restore(const FrictionStretches& stretches);

 private:
    std::map<std::array<int, 6>, Eigen::Vector3d> ways_;
};

}  // namespace nbd

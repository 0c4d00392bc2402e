#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace nbd {

/// A point that a body carries: a sum of its nodes with weights that sum to 1, some of which may be negative.
/// Or a point of the world, with no body and no nodes.
struct CarriedPoint {
    int body = -1;
    std::vector<int> nodes{};
    std::vector<double> weights{};
};

/// The potential of two points that hold each other, in their difference d = a - b [3], metres:
///
///   1/2 d^T K d + 1/2 stiffness stretch^2 + tension s,   stretch = s - length,
///
/// where s = along.d, or |d| if `along` is zero. K is symmetric positive semi-definite. Where `pulls_only`,
/// a negative stretch counts as zero. Damping resists the rate of s where the second term acts.
struct BondLaw {
    Eigen::Matrix3d K = Eigen::Matrix3d::Zero();      // N/m
    double stiffness = 0;                             // N/m
    Eigen::Vector3d along = Eigen::Vector3d::Zero();  // unit, or zero
    double length = 0;                                // metres
    bool pulls_only = false;
    double damping = 0;  // N s/m
    double tension = 0;  // newtons, >= 0

    bool is_radial() const noexcept {
        return (stiffness > 0 || damping > 0 || tension > 0) && along.isZero(0);
    }

    struct Terms {
        double energy = 0;                                   // joules
        Eigen::Vector3d gradient = Eigen::Vector3d::Zero();  // newtons
        Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();   // N/m, without its negative part
        Eigen::Matrix3d drag = Eigen::Matrix3d::Zero();      // N s/m
    };
    Terms at(const Eigen::Vector3d& d) const;

    /// Lets forces be so many times as large.
    BondLaw& operator*=(double times) {
        K *= times;
        stiffness *= times;
        damping *= times;
        tension *= times;
        return *this;
    }
};

/// Two points that hold each other in a step.
struct Bond {
    CarriedPoint a{}, b{};
    BondLaw law{};
    // a - b at the start of the step, as a motion straight to where they were seen had it.
    Eigen::Vector3d difference = Eigen::Vector3d::Zero();
    int joint = -1;              // that it belongs to
    double velocity_factor = 1;  // c of the bodies that it joins, see TimeStep
    // By how much a and b move faster from each other than unknowns tell in a step with this c: where a body
    // is held, which may go by another one, m/s.
    Eigen::Vector3d lead = Eigen::Vector3d::Zero();
    enum class Time { start, middle, end };
    // With which arms: springs, and joints in a step of backward Euler, with those at its end; cords that
    // catch there with those at its start; all else with those in the middle. See ImpulsePlaces.
    Time acts_at = Time::end;

    // Whether it acts like elasticity, also by what it did before the step (see TimeStep), as springs do;
    // else like a contact, with its whole impulse in the step.
    bool is_spring = false;
};

}  // namespace nbd

#pragma once

#include <Eigen/Core>
#include <array>

#include "sim/contact/barrier_law.hpp"

namespace nbd {

/// A point of a body's surface as a weighted mean of up to three surface vertices: a vertex, a point on an
/// edge or a point on a face.
struct SurfacePoint {
    int body = -1;  // -1: a point of an obstacle
    int count = 0;
    std::array<int, 3> vertices{};
    std::array<double, 3> weights{};
};

/// Two points that may press on each other during a step. The contact force pushes `a` along the normal and
/// `b` in the opposite direction.
struct Contact {
    SurfacePoint a{}, b{};
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit
    // Velocity of the obstacle, m/s, less that by which earlier rates move the points in the step.
    Eigen::Vector3d wall_velocity = Eigen::Vector3d::Zero();
    double gap = 0;  // metres at the start of the step, as a motion straight to where they were seen had it
    BarrierLaw barrier{};
    double friction = 0;  // Coulomb's coefficient
    int obstacle = -1;    // its number, where b is a point of one
    // How far friction has drawn a from b along the surfaces before the step, and how far it draws at most,
    // metres; see FrictionMemory.
    Eigen::Vector3d stretch = Eigen::Vector3d::Zero();
    double slip_length = 0;

    /// The part of a vector along the surfaces.
    Eigen::Vector3d along(const Eigen::Vector3d& u) const { return u - normal.dot(u) * normal; }
    /// What friction resists to in a step of dt seconds, m/s: the stretch at its end over dt. u: velocity of
    /// a relative to b at the end of the step, without that of the wall.
    Eigen::Vector3d slip(const Eigen::Vector3d& u, double dt) const { return along(u) + stretch / dt; }
    /// The speed of slip from which on friction has its full size, m/s.
    double full_slip(double dt) const noexcept { return slip_length / dt; }
};

/// Settings of the contact response. The defaults suit soft solids of any size.
struct ContactConfig {
    double stiffness_scale = 1;  // stiffness of a layer of `thickness`, relative to the body
    double friction = 0.5;       // Coulomb's coefficient between bodies; obstacles have their own
    double thickness =
        0;  // distance at which contact begins, metres; 0: 0.1 % of the smallest body's diagonal
    // Residual of every body, contacts included, at which they count as settled, relative to its impulses in
    // the step, see ContactSolver::share_of_scales().
    double tolerance = 1e-5;
};

/// Throws std::invalid_argument naming the first number that is out of range.
void check_contact_config(const ContactConfig& config);

}  // namespace nbd

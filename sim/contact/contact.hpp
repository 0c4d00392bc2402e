#pragma once

#include <Eigen/Core>
#include <array>

namespace nbd {

/// A point of a body's surface as a weighted mean of up to three surface vertices: a vertex, a point of an
/// edge or of a face.
struct SurfacePoint {
    int body = -1;  // -1: no body, the point belongs to an obstacle
    int count = 0;
    std::array<int, 3> vertices{};
    std::array<double, 3> weights{};
};

/// Two points that may press on each other during a step. Contact force pushes `a` along the normal and `b`
/// the other way.
struct Contact {
    SurfacePoint a{}, b{};
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();         // unit
    Eigen::Vector3d wall_velocity = Eigen::Vector3d::Zero();  // of the obstacle, m/s
    double gap = 0;        // metres at the start of the step, negative where they overlap
    double area = 0;       // m2 of surface that this contact stands for
    double stiffness = 0;  // N/m
    double friction = 0;   // Coulomb's coefficient
};

/// How far apart, and how deep in each other, points may be to make a contact. Metres, >= 0.
struct ContactReach {
    double apart = 0, inside = 0;
    double most() const noexcept { return apart > inside ? apart : inside; }
};

/// How contacts answer. The defaults suit soft solids of any size.
struct ContactConfig {
    double stiffness_scale = 1;  // a layer of thickness `thickness` is this many times as stiff as the body
    double friction = 0.5;       // between bodies; obstacles carry their own
    double thickness = 0;        // metres at which contact begins; 0: 1 % of the smallest body's diagonal
    double damping = 2e-3;       // seconds: damping coefficient over stiffness
    double slip_velocity =
        1e-3;                 // m/s below which friction grows linearly with speed instead of being constant
    int iterations = 8;       // solves a step at most, to settle which contacts hold and which slip
    double tolerance = 1e-4;  // residual of the whole, contacts included, relative, at which they are settled
};

/// Throws std::invalid_argument naming the first number that is out of range.
void check_contact_config(const ContactConfig& config);

}  // namespace nbd

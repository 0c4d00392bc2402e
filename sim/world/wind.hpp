#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim/world/body_load.hpp"

namespace nbd {

/// What air does on the nodes of a body, and how that answers to their velocities.
struct Drag {
    Nodes forces;                         // [N, 3] newtons
    std::vector<Eigen::Matrix3d> slopes;  // [N] N s/m, symmetric, >= 0: by which forces fall with velocities
};

/// Air that flows past the surface of a body. A face of the area A and the outward normal n, whose corners
/// move at the mean velocity u past the air, feels the force
///
///   -1/2 density A (normal s^2 n + tangential |t| t),   s = max(n.u, 0),   t = u - (n.u) n.
///
/// It presses on faces that meet the air, drags along all, and leaves the lee of a body alone. The force is
/// minus the slope of a convex potential in u, so that air at rest only takes energy.
class Wind {
 public:
    /// load: of the kind `wind`. shape: must outlive the wind. Throws std::invalid_argument for faces out of
    /// range or named twice, and for numbers that are not finite or below 0.
    Wind(BodyLoad load, const ElasticBody& elastic, const ContactShape& shape);

    const BodyLoad& load() const noexcept { return load_; }
    BodyLoad& load() noexcept { return load_; }
    /// Velocity of the air at a time, m/s.
    Eigen::Vector3d air_at(double time) const { return load_.air.keys.at(time, load_.air.velocity); }

    /// Forces on the nodes at the positions x with the velocities v, both [N, 3]. The slopes of a face are
    /// lumped to its nodes, which is exact where these move alike.
    Drag drag(NodesRef x, NodesRef v, const Eigen::Vector3d& air) const;
    /// The potential whose slope by v the forces at x are, up to their sign, watts.
    double potential(NodesRef x, NodesRef v, const Eigen::Vector3d& air) const;

 private:
    /// Calls visit(face, normal, area, velocity past the air) for all faces.
    template <class Visit>
    void for_each_face(NodesRef x, NodesRef v, const Eigen::Vector3d& air, const Visit& visit) const;

    BodyLoad load_;
    const ContactShape* shape_;
    std::vector<int> faces_;
};

}  // namespace nbd

#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "sim/fem/elastic_body.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/patches/contact_shape.hpp"
#include "sim/world/keyed.hpp"

namespace nbd {

enum class LoadKind {
    force,         // in total, spread over the nodes in proportion to their masses
    torque,        // a couple, whose node forces turn the nodes about their centre of mass and sum to zero
    acceleration,  // times the nodes' masses, as gravity acts
    pressure,      // on faces of the surface along their normals inwards, as they are at the time
    muscle,        // fibres in tetrahedra that pull themselves together
    gas,           // in a cavity, whose faces it presses on by how much room it has
    wind,          // air that flows past faces of the surface
};

/// A fixed amount of gas, p V^exponent = const.
struct CavityGas {
    double pressure = 101325;  // Pa, absolute, at the start
    double ambient = 101325;   // Pa, absolute, which presses from outside on all of the body
    double exponent = 1;       // 1: as warm as what is around it; 1.4: air without exchange of heat
};

/// Air that flows, see Wind.
struct AirFlow {
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s
    Keyed<Eigen::Vector3d> keys{};                       // in place of it; none: it stays as it is
    double density = 1.2;                                // kg/m3
    double normal = 1, tangential = 0;                   // coefficients across and along a face
};

/// An outer load on a body.
///
/// A torque and a pressure follow the body. Their node forces are those of the pose at which a step is
/// linearised, and their derivatives are left out of the step's matrix. Long steps of a block pressed from
/// all sides come to rest in the right shape up to a tenth of Young's modulus, but not at a third. Newton's
/// iteration balances the forces of the pose in which the step ends, and its line search counts their work:
/// it does so at a third, too, with more linearisations the higher the pressure.
///
/// A muscle has fibres along directions d of the rest pose. Their tension, over their area at rest, does not
/// depend on how long they are: with the deformation gradient F its potential is tension |F d| for a volume
/// at rest, and its stress is tension F d d^T / |F d|. It follows the body likewise. A bar whose fibres run
/// along it is shorter by tension / Young's modulus. The step's matrix has its derivative, which is >= 0, so
/// that a free body that contracts hardly turns.
struct BodyLoad {
    LoadKind kind = LoadKind::force;
    Eigen::Vector3d value = Eigen::Vector3d::Zero();  // N, N m or m/s2
    double pressure = 0;                              // Pa
    double tension = 0;                               // of a muscle, Pa
    std::vector<int> nodes{};                         // distinct rows of the tet nodes; none: all
    std::vector<int> faces{};                         // distinct, under pressure or wind; none: all
    std::vector<int> tets{};                          // distinct, of a muscle
    std::vector<Eigen::Vector3d> fibres{};            // [tets] of a muscle, unit, in the rest pose
    std::vector<double> shares{};                     // [nodes] of a force; none: as their masses
    Keyed<double> factor{};                           // of the load, or of the amount of gas; none: 1
    CavityGas gas{};
    AirFlow air{};
    int number = 0;  // among the loads of its body, as World::add_body() sets it

    bool follows() const noexcept {
        return kind == LoadKind::torque || kind == LoadKind::pressure || kind == LoadKind::muscle;
    }
};

/// Throws std::invalid_argument for a gas with numbers out of range, and for one in a rigid body.
void check_gas(const BodyLoad& load, const ElasticBody& elastic);

/// The load of a body, ready for steps. A gas is none, see ClosedGas, and neither is a wind, see Wind.
class LoadForces {
 public:
    /// Throws std::invalid_argument for a node or face out of range or named twice, numbers that are not
    /// finite, times that do not increase, a torque on nodes of one line, a muscle without tetrahedra or with
    /// other than a unit direction for each, and shares that are not one for each node with a positive sum.
    LoadForces(BodyLoad load, const ElasticBody& elastic, const ContactShape& shape);

    const BodyLoad& load() const noexcept { return load_; }
    Keyed<double>& factor() noexcept { return load_.factor; }

    /// Adds the node forces at the positions x, [N, 3] metres, times a factor. out: [N, 3] newtons.
    void add(NodesRef x, double factor, Nodes& out) const;
    /// Appends how forces of a muscle answer to motion from x: its fibres turn with what they pull. The
    /// springs refer to the load. Other loads have none.
    void add_springs(NodesRef x, double factor, std::vector<NodeSpring>& out) const;

 private:
    void add_torque(NodesRef x, double factor, Nodes& out) const;
    void add_pressure(NodesRef x, double factor, Nodes& out) const;
    void add_curved_pressure(NodesRef x, double factor, Nodes& out) const;
    void add_muscle(NodesRef x, double factor, Nodes& out) const;
    void find_middles(const ElasticBody& elastic);
    void find_fibres(const ElasticBody& elastic);

    BodyLoad load_;
    std::vector<int> nodes_;   // that carry a force, torque or acceleration
    Eigen::VectorXd weights_;  // [nodes_] kg
    const ContactShape* shape_;
    std::vector<int> faces_;  // under pressure
    // Of quadratic bodies: the middles of edges at rest, [middles, N] as the shape's W, and those of each
    // face from its first, second and third corner on.
    Embedding middles_;
    std::vector<std::array<int, 3>> middles_of_;  // [faces_]; empty: faces are flat
    // At a point of integration, F d is the sum of the nodes' positions times these factors.
    struct Fibre {
        double volume;  // m3 at rest
        std::vector<int> nodes;
        std::vector<double> factors;  // [nodes] 1/m, with the sum 0

        Eigen::RowVector3d stretched(NodesRef x) const;  // F d
    };
    std::vector<Fibre> fibres_;  // of a muscle
};

}  // namespace nbd

#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "collision/pair_query.hpp"
#include "sim/body_contact.hpp"
#include "sim/contact_solver.hpp"
#include "sim/grip.hpp"
#include "sim/step_system.hpp"
#include "sim/world_snapshot.hpp"

namespace nbd {

/// When a simulation has gone wrong for good.
struct FailureLimits {
    double inverted_share = 0.02;  // of the tetrahedra
    double stretch = 10;           // Frobenius norm of a deformation gradient
};

struct WorldConfig {
    Eigen::Vector3d gravity{0, 0, -9.81};  // m/s2
    ContactConfig contact{};
    FailureLimits limits{};
    LinearSolveConfig linear{};
    std::shared_ptr<RestFactors> factors{};  // shared with other worlds of the same bodies; null: own
};

/// A body as it enters a world.
struct WorldBody {
    std::shared_ptr<const ElasticBody> elastic;
    Embedding W;                                  // [surface vertices, tet nodes]
    Faces F;                                      // of the surface
    std::shared_ptr<const CollisionTree> tree{};  // over W, F; null: meets obstacles only, never bodies
    BoundKind bounds = BoundKind::exact;
    float margin = 0;   // relative, of the tree's spheres
    BodyState state{};  // empty x: at rest in its rest pose
    std::vector<Grip> grips{};
};

/// What a step did. Contact figures belong to the start of the step, energies and elements to its end.
struct WorldReport {
    double time = 0;            // seconds, end of the step
    int contacts = 0;           // pressing
    long face_pairs = 0;        // of two bodies, close enough to be looked at
    long nodes_bounded = 0;     // spheres of collision trees computed
    double update_us = 0;       // microseconds to start the trees' poses
    double collision_us = 0;    // microseconds of the queries for face pairs
    int solver_iterations = 0;  // of conjugate gradients
    bool solver_converged = true;
    double kinetic_energy = 0, elastic_energy = 0,
           gravity_energy = 0;       // joules; gravity's is 0 at the origin
    double deepest_penetration = 0;  // metres, >= 0
    int inverted_elements = 0;
    std::string failure{};  // empty: all is well; else one line, and the world must not be stepped again
};

/// Deformable bodies among obstacles under gravity, in contact with all of them and with each other. A step
/// is backward Euler, linearised at its start, with implicit contact forces (see ContactSolver). The same
/// calls give the same bits, on any number of threads.
class World {
 public:
    /// Throws std::invalid_argument on a number out of range.
    explicit World(const WorldConfig& config);

    /// Returns the body's number: 0, 1, ... Throws std::invalid_argument on what does not fit together.
    int add_body(WorldBody body);
    /// Throws std::invalid_argument on an unusable obstacle.
    void add_obstacle(Obstacle obstacle);

    /// Advances by dt seconds, > 0. Where the report names a failure, states that became unusable are kept as
    /// they were before the step. Throws std::invalid_argument on a bad dt.
    WorldReport step(double dt);

    int body_count() const noexcept { return static_cast<int>(bodies_.size()); }
    double time() const noexcept { return time_; }
    double thickness() const noexcept;  // metres at which contact begins
    const ElasticBody& elastic(int body) const { return *at(body).elastic; }
    const BodyState& state(int body) const { return at(body).state; }
    const ContactSurface& surface(int body) const { return at(body).surface; }

    /// Outer forces on the nodes, [N, 3] newtons; they act until changed. Zero at first.
    Nodes& forces(int body) { return at(body).forces; }

    /// Face pairs of two bodies that intersect now, by the bodies' own bounds. Both need a tree.
    std::vector<FacePair> intersecting(int a, int b);

    /// Mean forces of all contacts, friction included, on the tet nodes of a body during the last step:
    /// [N, 3] newtons. Those between bodies sum to zero over the bodies. Zero before the first step and
    /// after restore().
    const Nodes& contact_forces(int body) const { return at(body).contact_forces; }

    WorldSnapshot snapshot() const;

    /// Continues from a snapshot of a world with the same bodies. Throws std::invalid_argument where it does
    /// not fit them; nothing is changed then.
    void restore(const WorldSnapshot& snapshot);

 private:
    struct Body {
        std::shared_ptr<const ElasticBody> elastic;
        ContactSurface surface;
        std::unique_ptr<PosedTree> tree;  // null: none
        BodyState state;
        Nodes forces, contact_forces;
        std::vector<Grip> grips;
        std::vector<Nodes> grip_start;  // where each grip took its nodes
        ElementPose pose;
    };
    struct BodyPair {
        int a, b;
        BodyContactFinder finder;
    };

    Body& at(int body) { return bodies_.at(static_cast<std::size_t>(body)); }
    const Body& at(int body) const { return bodies_.at(static_cast<std::size_t>(body)); }
    bool has_vertex(int body, int vertex) const;
    double fastest(const Body& body, const Eigen::Vector3d& frame) const;
    void find_contacts(double dt, WorldReport& report);
    void find_body_contacts(BodyPair& pair, double dt, WorldReport& report);
    PrescribedNodes prescribed(const Body& body, double dt) const;
    Eigen::VectorXd stacked_velocities() const;
    void build_systems(double dt);
    void advance(double dt, const Eigen::VectorXd& v, WorldReport& report);
    void measure(WorldReport& report) const;

    WorldConfig config_;
    std::vector<Body> bodies_;
    std::vector<StepSystem> systems_;
    std::vector<int> first_unknown_{0};
    std::vector<Obstacle> obstacles_;
    std::vector<BodyPair> pairs_;
    PairQuery query_;
    ContactSolver solver_;
    std::vector<Contact> contacts_;
    double time_ = 0, deepest_ = 0;
};

}  // namespace nbd

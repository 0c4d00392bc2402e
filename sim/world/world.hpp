#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "sim/contact/contact_detection.hpp"
#include "sim/contact/contact_solver.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/world/grip.hpp"
#include "sim/world/world_snapshot.hpp"

namespace nbd {

/// When a simulation has gone wrong for good.
struct FailureLimits {
    double inverted_share = 1;  // of the tetrahedra; what is crushed recovers, so none is too many by default
    double stretch = 10;        // Frobenius norm of a deformation gradient
};

/// How hard a step works at its equations.
struct StepConfig {
    int newton_iterations = 1;       // linearisations of elasticity at most; more than 1: with line search
    double newton_tolerance = 1e-3;  // residual impulse over that of the loads at which Newton stops
    int max_substeps = 8;            // a power of two: parts that a step in trouble is cut into; 1: never
};

struct WorldConfig {
    Eigen::Vector3d gravity{0, 0, -9.81};  // m/s2
    ContactConfig contact{};
    FailureLimits limits{};
    LinearSolveConfig linear{};
    std::shared_ptr<RestFactors> factors{};  // shared with other worlds of the same bodies; null: own
    StepConfig step{};
};

/// A body as it enters a world.
struct WorldBody {
    std::shared_ptr<const ElasticBody> elastic;
    Embedding W;                                  // [surface vertices, tet nodes]
    Faces F;                                      // of the surface
    std::shared_ptr<const CollisionTree> tree{};  // over W, F; null: meets obstacles only, never bodies
    BoundKind bounds = BoundKind::exact;
    std::optional<float> margin{};  // relative, of the tree's spheres; none: as PosedTree says
    BodyState state{};              // empty x: at rest in its rest pose
    std::vector<Grip> grips{};
};

/// What a step did. Counts and costs are sums over its sub-steps and those that were given up; contacts are
/// those of the last sub-step; energies, elements and penetration those at the end.
struct WorldReport {
    double time = 0;              // seconds, end of the step
    int contacts = 0;             // pressing
    long face_pairs = 0;          // of two bodies, close enough to be looked at
    long nodes_bounded = 0;       // spheres of collision trees computed
    long nodes_out_of_range = 0;  // of them exactly, their input being out of the calibrated range
    double update_us = 0;         // microseconds to start the trees' poses
    double collision_us = 0;      // microseconds of the queries for face pairs
    int substeps = 0;             // equal parts that the step was cut into
    int newton_iterations = 0;    // linearisations of elasticity
    double assemble_us = 0;       // microseconds to assemble the linear systems
    double solve_us = 0;          // microseconds of the linear solves, contacts settled
    int patch_nodes = 0;          // most nodes that a linear solve took exactly; see CoupledSolver
    int solver_iterations = 0;    // of conjugate gradients
    bool solver_converged = true;
    double kinetic_energy = 0, elastic_energy = 0,
           gravity_energy = 0;       // joules; gravity's is 0 at the origin
    double deepest_penetration = 0;  // metres, >= 0
    int inverted_elements = 0;
    std::string fallback{};  // empty, or one line: why a linear system was factorised after all
    std::string
        rejection{};        // empty, or one line: why the step was cut, and if that did not help, so it says
    std::string failure{};  // empty: all is well; else one line, and the world must not be stepped again
};

/// Deformable bodies among obstacles under gravity, in contact with all of them and with each other. A step
/// is backward Euler with implicit contact forces (see ContactSolver), linearised at its start or, on
/// request, iterated. A step in trouble is taken back and done in 2, 4, 8 ... equal parts: where the linear
/// system or Newton's iteration does not converge, bodies close in on each other faster than contact can see,
/// or get deeper into each other or an obstacle than contact should let them. The same calls give the same
/// bits, on any number of threads.
class World {
 public:
    /// Throws std::invalid_argument on a number out of range.
    explicit World(const WorldConfig& config);

    /// Returns the body's number: 0, 1, ... Throws std::invalid_argument on what does not fit together.
    int add_body(WorldBody body);
    /// Throws std::invalid_argument on an unusable obstacle.
    void add_obstacle(Obstacle obstacle);

    /// Advances by dt seconds, > 0. Where the report names a failure, the bodies are left as they were before
    /// the part that failed. Throws std::invalid_argument on a bad dt.
    WorldReport step(double dt);

    int body_count() const noexcept { return static_cast<int>(bodies_.size()); }
    double time() const noexcept { return time_; }
    double thickness() const noexcept;  // metres at which contact begins
    const ElasticBody& elastic(int body) const { return *at(body).elastic; }
    const BodyState& state(int body) const { return at(body).state; }
    const ContactSurface& surface(int body) const { return at(body).surface; }

    /// Outer forces on the nodes, [N, 3] newtons; they act until changed. Zero at first.
    Nodes& forces(int body) { return at(body).forces; }

    /// Motions of the regions that the body's tree knows, as `certified` bounds take them; empty where the
    /// body has other bounds. Last until the body moves.
    std::span<const RegionMotion> motion(int body) { return motion(at(body)); }

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
        std::unique_ptr<RegionMeter> meter{};  // null: the tree has other than `certified` bounds
        bool measured = false;                 // by the meter, in the present state
    };
    /// What hinders a step. Its end may be kept all the same unless it is a failure.
    struct Rejection {
        std::string reason{};  // empty: none
        bool failure = false;
    };

    Body& at(int body) { return bodies_.at(static_cast<std::size_t>(body)); }
    const Body& at(int body) const { return bodies_.at(static_cast<std::size_t>(body)); }
    bool has_vertex(int body, int vertex) const;
    void detect(double dt);
    void forget_contacts();
    std::span<const RegionMotion> motion(Body& body);
    PrescribedNodes prescribed(const Body& body, double dt) const;
    Eigen::VectorXd start_velocities(const std::vector<PrescribedNodes>& given) const;
    Nodes body_part(int body, const Eigen::VectorXd& stacked) const;
    Loads loads(const Body& body) const { return {.gravity = config_.gravity, .forces = body.forces}; }
    void build_systems(double dt, const std::vector<PrescribedNodes>& given, const Eigen::VectorXd* iterate);
    Rejection solve(double dt, Eigen::VectorXd& v, WorldReport& report);
    void search_line(double dt, const Eigen::VectorXd& from, Eigen::VectorXd& to);
    double residual(double dt, const Eigen::VectorXd& v);
    std::string move(double dt, const Eigen::VectorXd& v, double share, WorldReport& report);
    Rejection try_part(double dt, double end, double share, bool last, WorldReport& report);
    void reset(const WorldSnapshot& snapshot);
    void measure(WorldReport& report) const;

    WorldConfig config_;
    std::vector<Body> bodies_;
    std::vector<StepSystem> systems_;
    std::vector<int> first_unknown_{0};
    std::vector<Obstacle> obstacles_;
    PairQuery query_;
    ContactDetection detection_;
    ContactSolver solver_;
    double time_ = 0;
    double dt_before_ = 0;       // of the part that led to the present state; 0: none
    double detected_dt_ = 0;     // the step for which contacts are known at the present state; 0: none
    DetectionReport detected_;   // of that search
    ContactSides sides_before_;  // what that detection went by
};

}  // namespace nbd

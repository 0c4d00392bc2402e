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

/// Limits beyond which a simulation has failed.
struct FailureLimits {
    double inverted_share = 1;  // share of inverted tetrahedra; 1: any, as crushed ones recover
    double stretch = 10;        // maximum Frobenius norm of a deformation gradient
};

/// Settings of a step's solve.
struct StepConfig {
    int newton_iterations = 1;  // maximum number of linearisations of elasticity; above 1: with line search
    double newton_tolerance = 1e-3;  // residual impulse relative to that of the loads at which Newton stops
    int max_substeps = 8;  // maximum number of parts of a rejected step, a power of two; 1: never cut
};

struct WorldConfig {
    Eigen::Vector3d gravity{0, 0, -9.81};  // m/s2
    ContactConfig contact{};
    FailureLimits limits{};
    LinearSolveConfig linear{};
    std::shared_ptr<RestFactors> factors{};  // shared with other worlds of the same bodies; null: own ones
    StepConfig step{};
};

/// A body to add to a world.
struct WorldBody {
    std::shared_ptr<const ElasticBody> elastic;
    Embedding W;                                  // [surface vertices, tet nodes]
    Faces F;                                      // surface faces
    std::shared_ptr<const CollisionTree> tree{};  // over W, F; null: contacts with obstacles only
    BoundKind bounds = BoundKind::exact;
    std::optional<float> margin{};  // of the tree's spheres, relative; nullopt: PosedTree's default
    BodyState state{};              // empty x: at rest in the rest pose
    std::vector<Grip> grips{};
};

/// Report of a step. Counts and costs are sums over all sub-steps, rejected ones included; contacts are those
/// of the last sub-step; energies, elements and penetration are those at the end.
struct WorldReport {
    double time = 0;              // end of the step, seconds
    int contacts = 0;             // number of pressing contacts
    long face_pairs = 0;          // close face pairs of two bodies that were examined
    long nodes_bounded = 0;       // spheres of collision trees that were computed
    long nodes_out_of_range = 0;  // those bounded exactly: input out of the calibrated range
    double update_us = 0;         // time to start the poses of the trees, microseconds
    double collision_us = 0;      // time of the queries for face pairs, microseconds
    int substeps = 0;             // number of equal parts of the step
    int newton_iterations = 0;    // linearisations of elasticity
    double assemble_us = 0;       // time to assemble the linear systems, microseconds
    double solve_us = 0;          // time of the linear solves, settling contacts included, microseconds
    int patch_nodes = 0;        // maximum number of nodes solved exactly in a linear solve; see CoupledSolver
    int solver_iterations = 0;  // conjugate gradient iterations
    bool solver_converged = true;
    double kinetic_energy = 0, elastic_energy = 0,
           gravity_energy = 0;       // joules; gravity's energy is 0 at the origin
    double deepest_penetration = 0;  // metres, >= 0
    int inverted_elements = 0;
    std::string fallback{};  // empty, or one line: why a linear system was factorised
    std::string
        rejection{};  // empty, or one line: why the step was cut, or why its smallest part was still rejected
    std::string failure{};  // empty: no failure; otherwise one line, and the world must not be stepped again
};

/// Deformable bodies among obstacles under gravity, in contact with obstacles and with each other. A step is
/// backward Euler with implicit contact forces (see ContactSolver), linearised at its start or, if requested,
/// iterated. A rejected step is undone and repeated in 2, 4, 8 ... equal parts. A step is rejected if the
/// linear system or Newton's iteration does not converge, if bodies approach each other faster than contact
/// detection can handle, or if they get too deep into each other or an obstacle. The same calls give the same
/// bits on any number of threads.
class World {
 public:
    /// Throws std::invalid_argument for a number out of range.
    explicit World(const WorldConfig& config);

    /// Returns the body's number: 0, 1, ... Throws std::invalid_argument for inconsistent data.
    int add_body(WorldBody body);
    /// Throws std::invalid_argument for an unusable obstacle.
    void add_obstacle(Obstacle obstacle);

    /// Advances by dt seconds, > 0. If the report names a failure, the bodies keep the state before the
    /// failed part. Throws std::invalid_argument for a bad dt.
    WorldReport step(double dt);

    int body_count() const noexcept { return static_cast<int>(bodies_.size()); }
    double time() const noexcept { return time_; }
    double thickness() const noexcept;  // distance at which contact begins, metres
    const ElasticBody& elastic(int body) const { return *at(body).elastic; }
    const BodyState& state(int body) const { return at(body).state; }
    const ContactSurface& surface(int body) const { return at(body).surface; }

    /// External forces on the nodes, [N, 3] newtons. Initially zero; they act until changed.
    Nodes& forces(int body) { return at(body).forces; }

    /// Motions of the regions of the body's tree, for `certified` bounds; empty for other bounds. Valid until
    /// the body moves.
    std::span<const RegionMotion> motion(int body) { return motion(at(body)); }

    /// Face pairs of two bodies that intersect now, by the bodies' own bounds. Both bodies need a tree.
    std::vector<FacePair> intersecting(int a, int b);

    /// Mean forces of all contacts, friction included, on the tet nodes of a body during the last step: [N,
    /// 3] newtons. Forces between bodies sum to zero over the bodies. Zero before the first step and after
    /// restore().
    const Nodes& contact_forces(int body) const { return at(body).contact_forces; }

    WorldSnapshot snapshot() const;

    /// Continues from a snapshot of a world with the same bodies. Throws std::invalid_argument if it does not
    /// fit them, and then changes nothing.
    void restore(const WorldSnapshot& snapshot);

 private:
    struct Body {
        std::shared_ptr<const ElasticBody> elastic;
        ContactSurface surface;
        std::unique_ptr<PosedTree> tree;  // null: no tree
        BodyState state;
        Nodes forces, contact_forces;
        std::vector<Grip> grips;
        std::vector<Nodes> grip_start;  // positions at which each grip took its nodes
        ElementPose pose;
        std::unique_ptr<RegionMeter> meter{};  // null unless the tree has `certified` bounds
        bool measured = false;                 // the meter holds the current state
    };
    /// Why a step was rejected. A non-fatal result may still be kept.
    struct Rejection {
        std::string reason{};  // empty: not rejected
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
    double dt_before_ = 0;       // length of the part that led to the current state; 0: none
    double detected_dt_ = 0;     // step for which contacts of the current state are known; 0: none
    DetectionReport detected_;   // report of that detection
    ContactSides sides_before_;  // sides before that detection
};

}  // namespace nbd

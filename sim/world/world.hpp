#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "sim/barrier/barrier.hpp"
#include "sim/contact/contact_solver.hpp"
#include "sim/fem/step_report.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/fem/time_step.hpp"
#include "sim/world/body_load.hpp"
#include "sim/world/cavity.hpp"
#include "sim/world/grip.hpp"
#include "sim/world/joint.hpp"
#include "sim/world/reactions.hpp"
#include "sim/world/statics.hpp"
#include "sim/world/wind.hpp"

namespace nbd {

/// Limits beyond which a simulation has failed.
struct FailureLimits {
    double inverted_share = 1;  // of the tetrahedra; crushed bodies recover, so the default allows all
    double stretch = 10;        // Frobenius norm of a deformation gradient
};

/// How steps advance bodies in time.
enum class TimeIntegrator {
    second_order,    // hardly damps; see TwoStepWeights
    backward_euler,  // damps vibrations, the more the fewer steps they take; a long step ends in balance
};

/// How steps are taken, and how accurately they solve their equations.
struct StepConfig {
    TimeIntegrator integrator = TimeIntegrator::second_order;
    Tangent tangent = Tangent::rotated;
    // Maximum number of linearisations; above 1 with line search, until newton_tolerance is met. 1: one, or
    // as many as contacts need.
    int newton_iterations = 1;
    // Newton stops at this residual impulse of every body, relative to its impulses of loads, elasticity and
    // contacts in the step, in the norm of the inverse masses, see ContactSolver::share_of_scales().
    double newton_tolerance = 1e-3;
    int max_substeps = 8;  // a power of two: a rejected step is cut into at most this many parts
};

struct WorldConfig {
    Eigen::Vector3d gravity{0, 0, -9.81};   // m/s2
    Keyed<Eigen::Vector3d> gravity_keys{};  // in place of it, m/s2; none: it stays as it is
    ContactConfig contact{};
    FailureLimits limits{};
    LinearSolveConfig linear{};
    std::shared_ptr<RestHierarchies>
        hierarchies{};  // may be shared by worlds of the same bodies; null: not shared
    StepConfig step{};
    std::optional<StaticConfig> statics{};  // none: steps in time
    // What positions of this world are counted from, metres, for those who tell them; steps do not depend on
    // it.
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
};

/// What World::add_body() takes.
struct WorldBody {
    std::shared_ptr<const ElasticBody> elastic;
    Embedding W;                                  // [surface vertices, tet nodes]
    Faces F;                                      // of the surface
    std::shared_ptr<const CollisionTree> tree{};  // of the surface W, F; null: exact bounds of its own
    BoundKind bounds = BoundKind::exact;          // `auto`: as exact_for_auto() says
    std::optional<float> margin{};  // relative, of the tree's spheres; none: PosedTree's default
    BodyState state{};              // empty x: the rest pose without velocity
    std::vector<Grip> grips{};
    std::vector<BodyLoad> loads{};
    // Coulomb's coefficient of each surface vertex, where no rule for a pair has one; below 0: the usual one.
    // Empty: of all. Between vertices it is interpolated; of two surfaces with their own, the smaller one
    // holds.
    std::vector<double> friction{};
    std::string name{};  // in messages; empty: "body 0", ...
};

/// A cord of a length that is told, without friction: its tension is the same all along its parts. It pulls
/// where it is taut, and a stiffness keeps it from getting longer.
struct Tendon {
    std::vector<int> parts;  // joints that are cords with a given tension, which this sets instead
    double fixed = 0;        // length of parts between points of the world, metres
    Keyed<double> winch{};   // its whole length at rest, metres, > 0
    double stiffness = 0;    // N/m; 0: it does not stretch
};

/// What a step did, in numbers and in words.
struct WorldReport : StepReport {
    bool contacts_settled = true;  // see ContactSolveReport::settled
    std::string fallback{};  // empty, or one line: why the iterative solver last fell back to a factorisation
    std::string rejection{};       // empty, or one line: why a part of the step was last rejected
    std::string trouble_reason{};  // empty, or one line about `trouble`
    double imbalance = 0;          // of the worst body at the end of a static increment, see StaticConfig
    std::string failure{};  // empty, or one line: why the step failed; the world must not be stepped again
};

/// What a step has to know of the one before it.
struct PastStep {
    Nodes v;                // velocities at its start, [N, 3] m/s
    Nodes inner_forces;     // of elasticity, its damping and springs there, [N, 3] newtons
    std::vector<int> held;  // nodes with prescribed velocities in the step
};

/// The state of a world, without its bodies, obstacles, joints and outer forces. A world built from the same
/// ones and restored from a snapshot continues with the same bits. Plain arrays, reals in double, so that a
/// file can keep them exactly.
struct WorldSnapshot {
    double time = 0;                // seconds
    double dt_before = 0;           // length of the part of a step that ended here, seconds; 0: none
    std::vector<BodyState> bodies;  // positions and velocities, one per body
    // Forces of elasticity, its damping and joints on the nodes as the last step has balanced them, [N, 3]
    // newtons, and what that step began with, of each body. Empty arrays or an empty list: not known. Whoever
    // changes `bodies` has to clear both.
    std::vector<Nodes> inner_forces;
    std::vector<PastStep> before;
    FrictionStretches stretches;
    // Where grips took their nodes that take them after the body was added: [bodies][grips][nodes, 3],
    // metres, without rows of the others and of those that have not taken them. Empty: none have.
    std::vector<std::vector<Nodes>> taken_at;
    std::vector<char> broken{};  // [joints]; empty: none is
    std::vector<JointLoad>
        springs_before{};  // [joints] of springs at the start of the last step; empty: none
};

/// The hollow within a closed part of a body's surface.
struct CavityState {
    int body = 0, number = 0;  // of the cavity among those of the body, in the order of its faces
    double volume = 0;         // m3
    double pressure = 0;       // of its loads and its gas, Pa, above the ambient pressure
};

/// A body that was moved as a whole.
struct StartMove {
    int body = 0;
    Eigen::Vector3d by = Eigen::Vector3d::Zero();  // metres
};

/// Deformable bodies and obstacles under gravity, in contact with each other and with themselves. A step is
/// of second order (see TwoStepWeights), with implicit contact forces (see ContactSolver) of a barrier that
/// keeps surfaces apart (see Barrier), linearised as often as contacts need, or solved by Newton's iteration.
/// It never ends with surfaces that intersect. A rejected step is taken back and repeated in 2, 4, 8 ...
/// equal parts. Reasons to reject: the linear system or Newton's iteration does not converge, a body and a
/// sphere approach each other too fast, or a failure. Bounds that can miss (see can_miss()) let features
/// press late; where a step would end with an intersection for that, or too near for the next, it is solved
/// anew with exact ones. The same calls give the same bits on any number of threads.
class World {
 public:
    /// Throws std::invalid_argument for a number out of range.
    explicit World(const WorldConfig& config);

    /// Returns the body's index: 0, 1, ... Throws std::invalid_argument where the parts of `body` disagree.
    int add_body(WorldBody body);
    /// Throws std::invalid_argument for an unusable obstacle.
    void add_obstacle(Obstacle obstacle);
    /// Sets what holds between two bodies, a body and an obstacle, or a body and itself; a, b: as
    /// PairRules::set(). Between steps, too: the next one checks then that what meets from now on is apart.
    /// Throws std::invalid_argument as PairRules::set(), and for a body or obstacle that is not there.
    void set_pair(int a, int b, const PairRule& rule);
    const PairRules& pairs() const noexcept { return pairs_; }

    /// Joins two bodies, or a body and the world, where they are now, and keeps them from meeting unless the
    /// joint or a cord lets them. Returns the joint's index: 0, 1, ... Throws std::invalid_argument as
    /// check_joint(), and where a place of the joint lies too far outside of a body that deforms.
    int add_joint(Joint joint);
    /// Lets joints be the parts of a tendon. Throws std::invalid_argument for joints that are not there, are
    /// no cords with a given tension or are part of another one, and for numbers out of range; in statics,
    /// too.
    void add_tendon(Tendon tendon);
    int joint_count() const noexcept { return joints_.size(); }
    const Joint& joint(int index) const { return joints_.at(index).joint(); }
    /// The angle of a hinge, radians, the way of a slider or the length of a cord, metres; 0 of others.
    double joint_value(int index) const { return joints_.at(index).value(nodes_now()); }
    /// Whether a force has torn it apart.
    bool is_broken(int joint) const { return broken_.at(joint) != 0; }

    /// Advances by dt seconds, > 0, or in statics by an increment, see StaticConfig. On a failure, see the
    /// report, the bodies are left as they were before the part that failed. Throws std::invalid_argument on
    /// a bad dt, and before the first step if surfaces intersect; StopAsked as stop_if_asked(). Whatever is
    /// thrown, the world is as before the step, without contact forces.
    WorldReport step(double dt);

    int body_count() const noexcept { return bodies_.size(); }
    std::span<const Obstacle> obstacles() const noexcept { return obstacles_; }  // as they were added
    double time() const noexcept { return time_; }
    const Eigen::Vector3d& origin() const noexcept { return config_.origin; }
    double thickness() const noexcept;          // contact begins at this distance, metres
    double smallest_diagonal() const noexcept;  // of the boxes of the bodies' surfaces at rest, metres
    const ElasticBody& elastic(int body) const { return *at(body).elastic; }
    /// The arrays keep their place in memory as long as the world lives.
    const BodyState& state(int body) const { return at(body).state; }
    const ContactShape& shape(int body) const { return *at(body).shape; }
    /// Positions of the vertices of a body's surface, [n, 3].
    Nodes surface(int body) const { return embedded(at(body).shape->W, at(body).state.x); }

    /// Outer forces on the tet nodes, [N, 3] newtons, besides those of WorldBody::loads. They act until
    /// changed; initially zero. No energy of a report counts outer forces or loads.
    Nodes& forces(int body) { return at(body).forces; }

    /// Moves nodes of a body in the next step, on straight lines to `targets`, [nodes, 3] metres, and holds
    /// them there until the next call, which replaces them; no nodes: frees all. As little a part of
    /// snapshots as outer forces. Throws std::invalid_argument for a node out of range, named twice or in a
    /// grip, and for targets of another shape or not finite.
    void drive(int body, std::vector<int> nodes, Nodes targets);

    /// Moves an obstacle evenly in the next step, to a place that is displaced from its own, and ends what
    /// was told of its motion for later: it stays there. The time of `place` does not count; the centre of
    /// turns and scales is that of its motion. It turns the shortest way. As little a part of snapshots as
    /// outer forces. Throws std::invalid_argument for an obstacle that there is not, and numbers as
    /// check_motion().
    void move_obstacle(int obstacle, Keyframe place);

    /// Likewise a grip, by its number among those of the body: from where it took its nodes.
    void move_grip(int body, int grip, Keyframe place);

    /// Brings the motor of a hinge or slider, radians or metres, the winch of a cord, metres, or its tension,
    /// newtons, evenly to a value in the next step, and ends what was told for later: it stays there. As
    /// little a part of snapshots as outer forces. Throws std::invalid_argument for a joint that is not there
    /// or has none of these, and a value that is not finite, or is not one of a length or tension.
    void set_joint(int joint, double value);

    /// Likewise the factor of a load of a body, by its number among those of the body: of a muscle its
    /// activation, of a gas its amount.
    void set_load(int body, int load, double factor);

    /// Likewise the velocity of the air of a load that is a wind, m/s.
    void set_wind(int body, int load, const Eigen::Vector3d& velocity);

    /// Face pairs of two bodies at most `distance` apart in the current pose, metres, >= 0, found with the
    /// bodies' bounds, in single precision. Throws std::invalid_argument where one of them has no tree.
    std::vector<FacePair> within(int a, int b, double distance);

    /// All faces that intersect: between bodies, with meshes of obstacles, and within a body, where faces
    /// with common vertices have other points in common, too. By exact tests of positions in double
    /// precision. Without those of touching_at_rest().
    std::vector<Intersection> intersecting_faces();
    /// Faces of one body that intersect at rest, as scans have some. They and their neighbours do not press
    /// each other.
    std::vector<Intersection> touching_at_rest();

    /// Throws std::invalid_argument, naming the faces, where surfaces intersect or touch; what is held may
    /// touch, see Barrier. The first step does it if nobody did before.
    void check_start();

    /// Whether nothing holds a body, so that resolve_start() may move it. -1, an obstacle: no.
    bool can_be_moved(int body) const;

    /// Moves bodies without grips and joints apart, and out of obstacles, until nothing intersects or is too
    /// near to start. Returns the moves. Throws std::invalid_argument, naming the faces, where that does not
    /// help: bodies that intersect themselves, or that are held; StopAsked as stop_if_asked(), and the world
    /// is as before.
    std::vector<StartMove> resolve_start();

    /// Likewise for bodies that only touch, or overlap by little: moves no body by more than a hundredth of
    /// its size. Returns no moves, and has moved nothing, where that is not needed or does not help.
    std::vector<StartMove> part_touching();

    /// Starts the pose of a tree over a body's surface as the world does for its own trees: from the body's
    /// nodes for `affine` bounds, else from surface(), both in single precision. Valid until the body moves.
    void begin_pose(int body, PosedTree& tree) { begin_pose(at(body), tree); }

    /// Mean contact forces, friction included, on the tet nodes of a body over the last step: [N, 3] newtons.
    /// Forces between bodies sum to zero. Zero before the first step and after restore().
    const Nodes& contact_forces(int body) const { return at(body).contact_forces; }

    /// What grips, driven nodes, obstacles, joints, winds and other bodies exerted on bodies in the last
    /// step, in a fixed order; of two bodies in contact, what acts on the one with the smaller number.
    /// Torques are about the origin that users see, not origin(), with arms in the middle of the step. What
    /// the solver left of the balance of a held body's free nodes is shared by its held ones. Besides, one
    /// for each cavity. Empty before the first step and after restore().
    std::vector<Reaction> reactions() const;

    /// All cavities of bodies, as they are now.
    std::vector<CavityState> cavities() const;

    WorldSnapshot snapshot() const;

    /// Continues from a snapshot of a world with the same bodies. Throws std::invalid_argument where it does
    /// not fit the bodies, and changes nothing then.
    void restore(const WorldSnapshot& snapshot);

 private:
    struct Body {
        std::shared_ptr<const ElasticBody> elastic;
        std::shared_ptr<const ContactShape> shape;
        PairBounds bounds;
        std::unique_ptr<PosedTree> tree;  // null: no tree
        BodyState state;
        std::optional<PastStep> before{};  // none: not known
        StepStart start{};                 // (x*, v*) of the step, see TimeStep
        Nodes inner_forces{};              // in `state`, with those of joints, [N, 3] N; empty: not known
        Nodes holding{};                   // [held, 3] impulses on held nodes in the part, N s
        double contact_young = 0;          // of the layer that its surface lies in, Pa
        Nodes forces, contact_forces;
        std::vector<LoadForces> loads;
        std::vector<Cavity> cavities{};
        std::vector<ClosedGas> gases{};
        Nodes gas_end{};  // forces of gases at the end of the part, [N, 3] N; empty: it has none
        std::vector<Wind> winds{};
        std::vector<Drag> drags{};          // [winds] as linearised last at the unknown linearised_at
        std::vector<NodeSpring> springs{};  // of muscles, likewise
        Nodes linearised_at{};              // [N, 3] m/s; empty: it has neither
        // Outer forces in the part with loads, [N, 3] N: with the weights of the rates before it, and at its
        // end, as they were last linearised.
        Nodes outer_before, outer_end;
        double added = 0;  // when, seconds
        std::vector<Grip> grips;
        // Per grip, positions at which it took its nodes; no rows: it has not.
        std::vector<Nodes> grip_start;
        Nodes added_at;  // positions of all nodes then; empty: it has no grips
        DrivenNodes driven{};
        double energy = 0;               // elastic, joules, at the end of the last step
        Vertices posed{};                // what its trees' poses read
        std::vector<double> friction{};  // see WorldBody
        std::string name{};

        /// Whether a grip takes its nodes after the body was added.
        bool takes_later(std::size_t grip) const { return grips[grip].take > added; }
        bool could_take(const std::vector<Nodes>& places) const;
    };
    /// One of the equal parts of a step.
    struct StepPart {
        double dt = 0, end = 0;  // length and world time at the end, seconds
        double share = 0;        // of the whole step
        bool finest = false;     // may not be cut: its result is kept unless the rejection is fatal
    };
    /// Why a part was rejected. The result of a non-fatal rejection may still be kept.
    struct Rejection {
        std::string reason{};  // empty: not rejected
        bool fatal = false;
        bool is_final = false;                    // smaller parts would not help
        StepTrouble trouble = StepTrouble::none;  // if it is kept
        explicit operator bool() const noexcept { return !reason.empty(); }
    };
    /// The state that a rejected part is taken back to.
    struct PartStart {
        WorldSnapshot snapshot;
        std::vector<Nodes> contact_forces;  // [bodies]
        std::vector<double> energies;       // [bodies]
        ReactionSums reactions;
    };

    std::shared_ptr<const ContactShape> contact_shape(WorldBody& body) const;
    Body& at(int body) { return bodies_.at(body); }
    const Body& at(int body) const { return bodies_.at(body); }
    bool has_vertex(int body, int vertex) const;
    Nodes body_part(int body, const Eigen::VectorXd& stacked) const;
    Loads end_loads(const Body& body) const {
        Loads loads = outer_end_loads(body);
        if (body.gas_end.rows() > 0) loads.forces += body.gas_end;
        if (!body.drags.empty()) loads.forces += drag_forces(body, body.linearised_at);
        return loads;
    }
    Loads outer_end_loads(const Body& body) const {  // without gases and winds
        return {.gravity = gravity_at(time_ + step_.dt), .forces = body.outer_end};
    }
    void begin_pose(Body& body, PosedTree& tree);
    void forget_parts();
    void reset(const WorldSnapshot& snapshot);

    // world_step.cpp
    void take_step(double dt, WorldReport& report);
    void take_parts(double dt, const PartStart& begin, WorldReport& report);
    std::string when(double time) const;
    void tell_trouble(WorldReport& report) const;
    PartStart part_start() const;
    void take_back(const PartStart& start);
    double slip_length(double dt) const noexcept;
    Rejection try_part(const StepPart& part, WorldReport& report);
    Rejection solve_safely(const StepPart& part, Eigen::VectorXd& v, WorldReport& report);
    std::string move(const StepPart& part, const Eigen::VectorXd& v, bool is_solved, WorldReport& report);
    void measure(WorldReport& report) const;
    bool is_fit(const RigidVector& motion, int index) const;

    // approach.cpp
    Nodes foreseen_motion(const Body& body, double dt) const;
    Rejection pass_of_ball(double dt) const;

    // time_integration.cpp
    double largest_turn(double dt) const;
    void choose_steps(double dt);
    void begin_backward_euler(double dt);
    void measure_inner_forces(Body& body, double dt, const Nodes& of_joints);
    Nodes first_iterate(const Body& body) const;
    Nodes likely_velocities(const Body& body) const;
    bool is_held(const Body& body) const;
    Momentum end_momentum(int index, NodesRef x, const Momentum& contacts) const;
    Nodes middle(const Body& body) const;
    void take_holding(int index, const Nodes& holding, const Eigen::RowVector3d& springs);
    void advance(int index, const Nodes& w, const Eigen::VectorXd& impulses, const Eigen::VectorXd& all);

    std::vector<Nodes> nodes_after(double dt, const Eigen::VectorXd& v) const;

    // outer_forces.cpp
    Eigen::Vector3d gravity_at(double time) const;
    Nodes outer_forces(const Body& body, const Nodes& x,
                       const std::function<double(const Keyed<double>&)>& factor_of) const;
    Nodes end_forces(const Body& body, const Nodes& x, double dt) const;
    void begin_outer_forces(const TwoStepWeights& weights);
    void set_end_forces(Body& body, const Nodes& x);
    double excess_work(const Body& body, const Nodes& from, const Nodes& to) const;

    // cavities.cpp
    /// A gas in a part of a step, linearised at an iterate.
    struct StepGas {
        int body = 0;
        const ClosedGas* gas = nullptr;
        Nodes slope;                                     // of the volume, [N, 3] m2
        double volume = 0, pressure = 0, stiffness = 0;  // m3, Pa, Pa / m3
        double flow = 0;    // rate of the volume by the unknown of the iterate, m3/s
        double solved = 0;  // Pa, with which the systems are solved
    };
    void add_cavities(Body& body, std::vector<BodyLoad>& loads) const;
    Nodes gas_forces(const Body& body, const Nodes& x, double time) const;
    double gas_energy(const Body& body, const Nodes& x) const;
    void linearise_gases(int index, const Nodes& w);
    Eigen::VectorXd gas_pressures(const Eigen::VectorXd& v) const;
    void set_gas_pressures(const Eigen::VectorXd& pressures);
    Eigen::MatrixXd first_gas_response() const;
    ContactSolveReport solve_with_gases(Eigen::VectorXd& v);
    double gas_error(const Eigen::VectorXd& v) const;
    double share_of_cavities(double dt, const Eigen::VectorXd& v, const Eigen::VectorXd& to) const;

    // winds.cpp
    static void add_winds(Body& body, std::vector<BodyLoad>& loads);
    void linearise_loads(Body& body, const Nodes& w);
    Nodes drag_forces(const Body& body, std::size_t k, const Nodes& w) const;
    Nodes drag_forces(const Body& body, const Nodes& w) const;
    Nodes spring_forces(const Body& body, const Nodes& w) const;
    void add_tangents(int index, const Nodes& w);
    double drag_energy(const Body& body, const Nodes& w) const;
    double drag_error(const Eigen::VectorXd& v) const;
    void add_wind_reactions(const StepPart& part, int index, const Nodes& w, const Nodes& x);

    // reactions.cpp
    Nodes holding_impulses(int index, const Nodes& w, const Eigen::VectorXd& impulses);
    void add_holding_reactions(const StepPart& part, int index, const Nodes& x);
    void add_contact_reactions(const StepPart& part, std::span<const PairImpulse> pairs);

    // tendons.cpp
    int tendon_of(int joint) const;
    double taut_tension(std::size_t tendon, std::span<const Nodes> x) const;
    void find_tensions(double dt);
    void set_tensions(const Eigen::VectorXd& tensions);
    Eigen::MatrixXd first_tendon_response() const;
    ContactSolveReport solve_systems(Eigen::VectorXd& v);

    // targets.cpp
    Keyed<double>* told_of(int joint);
    Keyed<double>* factor_of(int body, int load);
    Wind* wind_of(int body, int load);
    void go_to_targets(double dt);

    // linearisation.cpp
    void start_driving(double dt);
    void take_nodes();
    PrescribedNodes prescribed(const Body& body, double dt) const;
    Eigen::VectorXd stacked(Nodes (World::*velocities)(const Body&) const,
                            const std::vector<PrescribedNodes>& given) const;
    void build_systems(const std::vector<PrescribedNodes>& given, const Eigen::VectorXd* iterate,
                       Tangent tangent);
    double residual(const Eigen::VectorXd& v);

    // balance.cpp
    /// What is out of balance at an iterate of an increment, over a body's free nodes.
    struct Imbalance {
        double off = 0, rounding = 0;  // sums of forces and of what rounding leaves of them, newtons
        double scale = 0;              // see StaticConfig::tolerance, newtons
        double net = 0;                // of the force and the torque over the body's size as a whole, newtons

        double share() const noexcept { return off > 0 ? off / scale : 0; }
        /// Whether it is at most `tolerance`, or what rounding leaves.
        bool is_balanced(double tolerance) const noexcept {
            return off <= std::max(tolerance * scale, rounding);
        }
    };
    /// How careful the next linearisation of an increment is.
    struct Caution {
        // Factors of what keeps bodies in place, of that by their way and of that by their stiffness, and of
        // what solves may leave.
        double way_hold = 1, stiffness_hold = 1, precision = 1;
        // The imbalance below which tangents are exact: those of a body that has to go far need not be
        // positive definite.
        double exact_below = std::numeric_limits<double>::infinity();
        static constexpr double exact_again = 0.1;  // of the imbalance at which they led astray

        bool takes_more_hold(bool was_exact, double imbalance) noexcept;
        bool solves_better() noexcept;
        bool goes_on(bool was_exact, double imbalance, bool went_far) noexcept;
    };
    double load_share(double time) const noexcept;
    std::vector<Imbalance> imbalances(double dt, const Eigen::VectorXd& v,
                                      const std::vector<PrescribedNodes>& given, bool is_assembled);
    void regularise(double dt, const Eigen::VectorXd& v, std::span<const Imbalance> imbalances,
                    const Caution& caution);
    double room_of(int body) const;
    Rejection balance(const StepPart& part, Eigen::VectorXd& v, WorldReport& report);
    void come_to_rest(const StepPart& part, const Eigen::VectorXd& v, const BodyPositions& ends);

    // resolve_start.cpp
    std::vector<Contact> too_near();
    Eigen::Vector3d way_out(int body, int obstacle, double room);

    // world_start.cpp
    Barrier& barrier();
    static HeldPose held_pose(const Body& body);
    std::string way_to_start(std::span<const std::array<int, 2>> pairs) const;

    // joints.cpp
    bool is_joined(int body) const;
    void forget_rates(const Joint& joint);
    void find_bonds(double dt, const Eigen::VectorXd& v);
    std::vector<Nodes> joint_forces(double dt);
    std::vector<Eigen::Vector3d> centres_of(std::span<const Nodes> x) const;
    JointLoad earlier_springs(std::size_t joint) const;
    Momentum earlier_springs_on(int body) const;
    void add_joint_reactions(const StepPart& part, const Eigen::VectorXd& v,
                             std::span<const Eigen::Vector3d> more, const BodyPositions& middles,
                             const BodyPositions& ends);
    void break_joints(double dt, const Eigen::VectorXd& v);
    std::string joint_fault(double dt, const Eigen::VectorXd& v) const;

    // solve.cpp
    std::vector<Nodes> nodes_now() const;
    bool held_nodes_move(double dt, const std::vector<PrescribedNodes>& given) const;
    Eigen::VectorXd leads(double dt) const;
    std::vector<Contact> contacts_at(double dt, const Eigen::VectorXd& v, double share, double progress,
                                     std::span<const ContactShape* const> shapes);
    double contact_error(double dt, const Eigen::VectorXd& v, std::span<const ContactShape* const> shapes);
    double strain_of_turns(double dt, const Eigen::VectorXd& v) const;
    double share_of_turns(double dt, const Eigen::VectorXd& from, const Eigen::VectorXd& to) const;
    double trusted_share(double dt, const Eigen::VectorXd& v, const Eigen::VectorXd& to) const;
    Rejection solve(const StepPart& part, Eigen::VectorXd& v, WorldReport& report);
    void look(double dt, const Eigen::VectorXd& v, const Eigen::VectorXd& to, double progress,
              WorldReport& report);
    double propose(double dt, const Eigen::VectorXd& v, const Eigen::VectorXd& to, double progress,
                   WorldReport& report);
    double search_line(const Eigen::VectorXd& v, const Eigen::VectorXd& to, double share);
    std::string end_fault(double dt, const Eigen::VectorXd& v, WorldReport& report);

    WorldConfig config_;
    std::vector<Body> bodies_;
    std::vector<StepSystem> systems_;
    std::vector<int> first_unknown_{0};
    std::vector<Obstacle> obstacles_;
    PairRules pairs_;
    /// Where what is told from step to step is brought in the next one.
    struct Targets {
        std::map<int, Keyframe> obstacles{};
        std::map<std::pair<int, int>, Keyframe> grips{};  // by body and number
        std::map<int, double> joints{};
        std::map<std::pair<int, int>, double> factors{};         // of loads, likewise
        std::map<std::pair<int, int>, Eigen::Vector3d> winds{};  // likewise
    };
    Targets next_;
    PairQuery query_;
    FrictionMemory friction_memory_;
    std::vector<JointBonds> joints_;
    std::vector<char> broken_;  // [joints]
    std::vector<Tendon> tendons_;
    std::vector<double> tendon_stiffness_;                // [tendons] in the part, N/m
    Eigen::VectorXd tensions_;                            // [tendons] that bonds have, newtons
    std::vector<JointLoad> springs_, springs_before_;     // [joints] of springs, now and a step before
    std::vector<std::shared_ptr<const NodeHold>> holds_;  // [bodies]; null: without joints
    std::vector<Contact> contacts_;                       // of solver_
    std::vector<Bond> bonds_;                             // likewise
    std::vector<StepGas> gases_;                          // of all bodies
    ContactSolver solver_;
    ReactionSums reactions_;            // of the step
    std::unique_ptr<Barrier> barrier_;  // null: not asked for yet
    bool start_is_checked_ = false;
    double time_ = 0;
    TimeStep step_ = 0.0;                                       // of the part
    Eigen::Vector3d gravity_before_ = Eigen::Vector3d::Zero();  // as Body::outer_before
    // Whether a rigid body turned much otherwise than foreseen, in a world with joints. A step of second
    // order, which goes on by what was before, would make energy then.
    bool turns_abruptly_ = false;
    bool knows_last_ = false;  // whether rates of the part before it count
    double dt_before_ = 0;     // length of the part that led to the current state; 0: none
};

}  // namespace nbd

#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "sim/barrier/barrier.hpp"
#include "sim/world/joint_forces.hpp"
#include "sim/world/part_solve.hpp"
#include "sim/world/reactions.hpp"
#include "sim/world/step_equations.hpp"
#include "sim/world/targets.hpp"
#include "sim/world/tendon_solve.hpp"
#include "sim/world/world_body.hpp"
#include "sim/world/world_config.hpp"
#include "sim/world/world_report.hpp"
#include "sim/world/world_state.hpp"

namespace nbd {

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
    const PairRules& pairs() const noexcept { return state_.pairs; }

    /// Joins two bodies, or a body and the world, where they are now, and keeps them from meeting unless the
    /// joint or a cord lets them. Returns the joint's index: 0, 1, ... Throws std::invalid_argument as
    /// check_joint(), and where a place of the joint lies too far outside of a body that deforms.
    int add_joint(Joint joint);
    /// Lets joints be the parts of a tendon. Throws std::invalid_argument for joints that are not there, are
    /// no cords with a given tension or are part of another one, and for numbers out of range; in statics,
    /// too.
    void add_tendon(Tendon tendon);
    int joint_count() const noexcept { return static_cast<int>(state_.joints.size()); }
    const Joint& joint(int index) const { return state_.joints.at(index).joint(); }
    /// The angle of a hinge, radians, the way of a slider or the length of a cord, metres; 0 of others.
    double joint_value(int index) const { return state_.joints.at(index).value(state_.nodes_now()); }
    /// Whether a force has torn it apart.
    bool is_broken(int joint) const { return state_.broken.at(joint) != 0; }

    /// Advances by dt seconds, > 0, or in statics by an increment, see StaticConfig. On a failure, see the
    /// report, the bodies are left as they were before the part that failed. Throws std::invalid_argument on
    /// a bad dt, and before the first step if surfaces intersect; StopAsked as stop_if_asked(). Whatever is
    /// thrown, the world is as before the step, without contact forces.
    WorldReport step(double dt);

    int body_count() const noexcept { return state_.body_count(); }
    std::span<const Obstacle> obstacles() const noexcept { return state_.obstacles; }  // as they were added
    double time() const noexcept { return state_.time; }
    const Eigen::Vector3d& origin() const noexcept { return state_.config.origin; }
    double thickness() const noexcept {
        return state_.thickness();
    }  // contact begins at this distance, metres
    double smallest_diagonal() const noexcept {
        return state_.smallest_diagonal();
    }  // of the boxes of the bodies' surfaces at rest, metres
    const ElasticBody& elastic(int body) const { return *state_.at(body).elastic; }
    /// The arrays keep their place in memory as long as the world lives.
    const BodyState& state(int body) const { return state_.at(body).state; }
    const ContactShape& shape(int body) const { return *state_.at(body).shape; }
    /// Positions of the vertices of a body's surface, [n, 3].
    Nodes surface(int body) const { return embedded(state_.at(body).shape->W, state_.at(body).state.x); }

    /// Outer forces on the tet nodes, [N, 3] newtons, besides those of WorldBody::loads. They act until
    /// changed; initially zero. No energy of a report counts outer forces or loads.
    Nodes& forces(int body) { return state_.at(body).forces; }

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
    /// its size. Bodies that would press something are moved to where they begin to: what presses at the
    /// start would throw them. Returns no moves, and has moved nothing, where that is not needed or does not
    /// help.
    std::vector<StartMove> part_touching();

    /// Starts the pose of a tree over a body's surface as the world does for its own trees: from the body's
    /// nodes for `affine` bounds, else from surface(), both in single precision. Valid until the body moves.
    void begin_pose(int body, PosedTree& tree) { begin_pose(state_.at(body), tree); }

    /// Mean contact forces, friction included, on the tet nodes of a body over the last step: [N, 3] newtons.
    /// Forces between bodies sum to zero. Zero before the first step and after restore().
    const Nodes& contact_forces(int body) const { return state_.at(body).contact_forces; }

    /// What grips, driven nodes, obstacles, joints, winds and other bodies exerted on bodies in the last
    /// step, in a fixed order; of two bodies in contact, what acts on the one with the smaller number.
    /// Torques are about the origin that users see, not origin(), with arms in the middle of the step. What
    /// the solver left of the balance of a held body's free nodes is shared by its held ones. Besides, one
    /// for each cavity. Empty before the first step and after restore().
    std::vector<Reaction> reactions() const;

    /// All cavities of bodies, as they are now.
    std::vector<CavityState> cavities() const;

    WorldSnapshot snapshot() const;

    /// Continues from a snapshot of a world with the same bodies. What was told for the next step is
    /// forgotten; what was told before has taken the place of what bodies and joints came with, and driven
    /// nodes go to their last targets in the next step. Throws
    /// std::invalid_argument where it does not fit the bodies, and changes nothing then.
    void restore(const WorldSnapshot& snapshot);

 private:
    /// The state that a rejected part is taken back to.
    struct PartStart {
        WorldSnapshot snapshot;
        std::vector<Nodes> contact_forces;  // [bodies]
        std::vector<double> energies;       // [bodies]
        ReactionSums reactions;
    };

    std::shared_ptr<const ContactShape> contact_shape(WorldBody& body) const;
    bool has_vertex(int body, int vertex) const;
    void begin_pose(SteppedBody& body, PosedTree& tree);
    void forget_parts();
    void reset(const WorldSnapshot& snapshot);

    // world_start.cpp
    Barrier& barrier();
    static HeldPose held_pose(const SteppedBody& body);
    std::string way_to_start(std::span<const std::array<int, 2>> pairs) const;

    // resolve_start.cpp
    std::vector<Contact> nearest_within(double distance);
    std::vector<StartMove> part_pressing();
    Eigen::Vector3d way_out(int body, int obstacle, double room);

    // world_step.cpp
    void start_driving(double dt);
    void take_nodes();
    void take_step(double dt, WorldReport& report);
    void take_parts(double dt, const PartStart& begin, WorldReport& report);
    std::string when(double time) const;
    void tell_trouble(WorldReport& report) const;
    PartStart part_start() const;
    void take_back(const PartStart& start);
    Rejection try_part(const StepPart& part, WorldReport& report);
    void measure(WorldReport& report) const;

    // part_end.cpp
    std::string move(const StepPart& part, const Eigen::VectorXd& v, bool is_solved, WorldReport& report);
    void end_short(const Eigen::VectorXd& solved, std::span<const Nodes> before);
    void come_to_rest(const StepPart& part, const Eigen::VectorXd& v, const BodyPositions& ends);
    void add_holding_reactions(const StepPart& part, int index, const Nodes& x);
    void add_contact_reactions(const StepPart& part, std::span<const PairImpulse> pairs);

    WorldState state_;
    StepEquations equations_;
    TendonSolve tendon_solve_;
    JointForces joint_forces_;
    Targets targets_;
    std::vector<std::shared_ptr<const NodeHold>> holds_;  // [bodies]; null: without joints
    PairQuery query_;
    FrictionMemory friction_memory_;
    ReactionSums reactions_;            // of the step
    std::unique_ptr<Barrier> barrier_;  // null: not asked for yet
    bool start_is_checked_ = false;
};

}  // namespace nbd

#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "sim/barrier/barrier.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/fem/time_step.hpp"
#include "sim/world/body_load.hpp"
#include "sim/world/cavity.hpp"
#include "sim/world/grip.hpp"
#include "sim/world/joint.hpp"
#include "sim/world/snapshot.hpp"
#include "sim/world/tendon.hpp"
#include "sim/world/wind.hpp"
#include "sim/world/world_config.hpp"

// What the parts of a world share: World owns it, and the rules of a step read and change it.
namespace nbd {

/// A body of a world, with what a step knows of it.
struct SteppedBody {
    std::shared_ptr<const ElasticBody> elastic;
    std::shared_ptr<const ContactShape> shape;
    PairBounds bounds;
    std::unique_ptr<PosedTree> tree;  // null: no tree
    BodyState state;
    std::optional<PastStep> before{};  // none: not known
    StepStart start{};                 // (x*, v*) of the step, see TimeStep
    double velocity_factor = 1;        // c, likewise
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

/// Bodies that are connected, directly or by others.
class BodyGroups {
 public:
    explicit BodyGroups(std::size_t bodies) {
        for (std::size_t b = 0; b < bodies; ++b) next_.push_back(static_cast<int>(b));
    }
    /// a, b: below 0, no body.
    void connect(int a, int b) {
        if (a < 0 || b < 0) return;
        const int of_a = group_of(a), of_b = group_of(b);
        next_[std::max(of_a, of_b)] = std::min(of_a, of_b);
    }
    /// The first body of the group.
    int group_of(int body) {
        while (next_[body] != body) body = next_[body] = next_[next_[body]];
        return body;
    }

 private:
    std::vector<int> next_;  // of the same group, with a smaller number, or itself
};

/// What a world holds: bodies, what meets, joins and moves them, and when it is.
struct WorldState {
    WorldConfig config{};
    std::vector<SteppedBody> bodies{};
    std::vector<int> first_unknown{0};  // of each body among those of all; the last is their number
    std::vector<Obstacle> obstacles{};
    PairRules pairs{};
    std::vector<JointBonds> joints{};
    std::vector<char> broken{};  // [joints]
    std::vector<Tendon> tendons{};
    double time = 0;       // seconds; in statics the share of the load that has come
    double dt_before = 0;  // length of the part of a step that led here; 0: none
    // Of the part of a step that is taken.
    double dt = 0;                                             // its length, seconds
    Eigen::Vector3d gravity_before = Eigen::Vector3d::Zero();  // as SteppedBody::outer_before
    bool knows_last = false;                                   // whether rates of the part before it count

    int body_count() const noexcept { return static_cast<int>(bodies.size()); }
    SteppedBody& at(int body) { return bodies.at(body); }
    const SteppedBody& at(int body) const { return bodies.at(body); }
    /// When the part ends.
    double end() const noexcept { return time + dt; }

    TimeStep step_of(const SteppedBody& body) const noexcept { return {dt, body.velocity_factor}; }
    /// c of what joins two bodies, which have the same if both can move; a body that is held throughout goes
    /// by no rule. b: -1 for the world.
    double velocity_factor_of(int a, int b) const {
        return b < 0 ? at(a).velocity_factor : std::min(at(a).velocity_factor, at(b).velocity_factor);
    }
    std::vector<TimeStep> steps() const;  // [bodies]
    /// A body's rows of the unknowns of all bodies, [N, 3].
    Nodes part_of(int body, const Eigen::VectorXd& stacked) const;
    std::vector<Nodes> nodes_now() const;
    /// Positions of the nodes of all bodies at dt with the unknown v of the step.
    std::vector<Nodes> nodes_after(double dt, const Eigen::VectorXd& v) const;
    /// Centres of mass of all bodies whose nodes are at x.
    std::vector<Eigen::Vector3d> centres_of(std::span<const Nodes> x) const;

    double smallest_diagonal() const noexcept;
    double thickness() const noexcept;
    /// The factor of gravity and of loads without keyframes.
    double load_share(double time) const noexcept;
    Eigen::Vector3d gravity_at(double time) const;

    /// Whether some of a body's nodes have prescribed velocities.
    bool is_held(const SteppedBody& body) const;
    /// Whether all of them have: nothing else moves it.
    bool is_held_throughout(const SteppedBody& body) const;
    /// Whether what holds a body lets it turn: its held nodes lie on a line, or it has none.
    bool can_turn(const SteppedBody& body) const;
    /// Where grips and what drives nodes bring these in a part of this length.
    PrescribedNodes prescribed(const SteppedBody& body, double dt) const;
    /// Whether a joint that is not broken holds it.
    bool is_joined(int body) const;
    /// Lets the next step know nothing of the rates before it: the forces of a joint begin or end.
    void forget_steps(const Joint& joint);
    /// The tendon that a joint is a part of; -1: none.
    int tendon_of(int joint) const;
};

}  // namespace nbd

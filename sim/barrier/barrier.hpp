#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sim/barrier/intersections.hpp"
#include "sim/barrier/near_features.hpp"
#include "sim/barrier/smooth_wall.hpp"
#include "sim/contact/contact.hpp"
#include "sim/contact/pair_rules.hpp"
#include "sim/obstacles/obstacle.hpp"
#include "sim/patches/contact_shape.hpp"

namespace nbd {

/// What something holds of a body, in the pose in which it was added.
struct HeldPose {
    Nodes nodes{};              // [N, 3] metres; empty: nothing is held
    std::vector<char> held{};   // [n] whether a vertex hangs on held nodes alone
    std::vector<char> stays{};  // [n] whether all of these stay where they are for ever
};

/// Keeps surfaces apart: between bodies, within each body, and of bodies and obstacles. A caller proposes a
/// motion of all surfaces; the barrier tells how much of it is free of collisions, and the potential and
/// contacts at any share of it. Surfaces that start apart are apart after every allowed share.
///
/// Meshes meet meshes by all pairs of a vertex and a face and of two edges; planes and balls meet the
/// vertices of bodies.
///
/// What touches at the start where it is held need not be kept apart: vertices on planes and balls count as
/// far from these as where they begin to press, also once they are let go. Features of meshes that touch at
/// points that stay for ever do not press each other, and their faces are no intersections().
class Barrier {
 public:
    /// reach: distance at which surfaces begin to press, metres, > 0. rules: which surfaces meet, by the
    /// numbers of bodies and obstacles in the order in which they are added.
    Barrier(const ContactConfig& config, double reach, PairRules rules = {})
        : config_(config), reach_(reach), rules_(std::move(rules)) {}

    /// rest: the body's tetrahedra at rest. young: modulus of its outer layer, Pa. bounds: by which it meets
    /// others. friction: see WorldBody. Add all bodies, then the obstacles, then call begin().
    void add_body(std::shared_ptr<const ContactShape> shape, const TetMesh& rest, double young,
                  const PairBounds& bounds = {}, HeldPose held = {}, std::vector<double> friction = {});
    void add_obstacle(const Obstacle& obstacle);
    void begin();
    /// Faces of bodies that intersect others of their body at rest. They, others nearly as near, and those
    /// about these do not press each other, and are no intersections().
    const std::vector<Intersection>& touching_at_rest() const noexcept {
        return intersection_search_.at_rest();
    }
    /// Whether a vertex of a body is held and touches an obstacle at the start.
    bool may_touch(int body, int vertex, int obstacle) const;
    /// Distance at which the potential becomes infinite, metres.
    double floor() const noexcept;
    /// What is no farther apart is too near to start a step, metres.
    double least_start() const noexcept { return 2 * floor(); }

    /// Starts a step at `time`, of length dt, seconds: the obstacles move on. In a step, points of a mesh go
    /// straight from where they are at its begin to where they are at its end; planes and balls turn evenly,
    /// the shortest way.
    void begin_step(double time, double dt);
    /// The motion of an obstacle, which may be told anew between steps.
    Motion& motion_of(int obstacle) { return walls_.at(obstacle).obstacle.motion; }

    /// Whether an obstacle moves in the step.
    bool obstacles_move() const;

    /// Guesses a motion: of the nodes of each body, [N, 3], and of the obstacles from a share of the step,
    /// `progress`, to its end. Finds what comes near in it. Contacts at its begin are no planes that the
    /// guess would lead up along a surface, see pair_weight().
    void look(std::span<const Nodes> begin, std::span<const Nodes> end, double progress);

    /// Proposes a motion likewise. Returns a share in [0, 1] of this motion up to which nothing collides and
    /// the distances of what presses shrink to a fifth at most; 1 if all of it is free. At its begin,
    /// surfaces must be apart.
    double move(std::span<const Nodes> begin, std::span<const Nodes> end, double progress);

    /// Whether bounds of bodies can miss what comes near: then intersections() alone is sure to find all.
    bool can_miss() const;
    /// Whether the bodies have exact bounds in the next motions, rather than those that were given.
    void be_exact(bool exact);

    /// Potential after a share of the motion, joules; infinite where surfaces are too near. Edges have the
    /// weights that they have at its begin, see pair_weight().
    double energy(double share);

    /// Contacts after a share of the motion with their laws, in a fixed order: of features within
    /// near_share of their reach, and of those that come within it in the rest of the motion as seen from
    /// there. Their gaps are their distances. Contacts of the same points are one, see merged().
    std::vector<Contact> contacts(double share);

    /// The least distance found by the last energy() or contacts(), of features within their reach; infinite
    /// if there were none.
    double least_distance() const noexcept { return least_distance_; }

    /// All other intersecting faces with the nodes of each body at these places, [N, 3], and the obstacles at
    /// their end of the step, by exact tests. Ends the motion that was proposed.
    std::vector<Intersection> intersections(std::span<const Nodes> nodes);

    /// Whether surfaces of bodies whose bounds can miss are too near others to start a step, in the pose of
    /// the last intersections().
    bool missed_too_near();

    const std::vector<MovingSurface>& surfaces() const noexcept { return surfaces_; }
    /// Of the last look() or move(): pairs of faces, times to place the surfaces and their trees and to query
    /// these.
    const StepReport& costs() const noexcept { return costs_; }

 private:
    static constexpr double floor_share = 1e-3;  // of the reach: distance at which the potential is infinite
    static constexpr double touching_share = 1e-2;   // of the reach: what is nearer at rest does not press
    static constexpr double left_share = 0.2;        // of the room above the floor that a motion must leave
    static constexpr double tolerance_share = 0.05;  // likewise, by which an impact may be found too early
    static constexpr double rise_share = 0.1;        // of the reach, by which a guess may lead up a plane

    struct Body {
        std::shared_ptr<const ContactShape> shape;
        double young;
        HeldPose held;
        std::vector<double> friction;  // see WorldBody
    };
    /// An obstacle: a mesh, which is one of the surfaces, or a plane or ball.
    struct Wall {
        Obstacle obstacle;
        int surface = -1;                    // -1: a plane or ball
        std::optional<SmoothWall> smooth{};  // a plane or ball
        bool moves = false;                  // in the step
        Nodes start_x{}, end_x{};            // of a mesh in the step
        /// Held vertices that touch it at the start, by body and number, and by how much farther from a plane
        /// or ball they count, metres.
        std::map<std::pair<int, int>, double> held_touch{};
    };
    /// A vertex that may come near a plane or a ball.
    struct NearSmooth {
        int body, vertex, wall;
    };

    /// Pairs of features that the last look() found.
    std::size_t feature_pairs() const noexcept { return near_.size() + near_smooth_.size(); }
    static double room_at(double distance, double floor, double reach);
    void see(std::span<const Nodes> begin, std::span<const Nodes> end, double progress);
    void place(std::span<const Nodes> begin, std::span<const Nodes> end, double progress);
    bool may_come_near(const MovingSurface& surface, std::span<const int> nodes, const Wall& wall) const;
    void find_near_smooth();
    void find_held_touch();
    void find_held_on_smooth();
    void find_held_pairs(int a, int b, std::vector<FeaturePair>& features, std::vector<Intersection>& faces);
    bool touches_where_held(const FeaturePair& pair) const;
    double limit(const NearFeatures& near) const;
    double limit(const NearSmooth& near) const;
    SurfaceDistance distance(const NearSmooth& near, double share) const;
    Eigen::Vector3d velocity_of(const NearFeatures& near, const MovingSurface& obstacle,
                                const ClosestPoints& closest) const;
    double farther(const NearSmooth& near) const;
    std::array<Eigen::Vector3d, 4> positions(const FeaturePair& pair, double share) const;
    const Wall* wall_of(const MovingSurface& surface) const;
    BarrierLaw law(double young, double area, double reach) const;
    BarrierLaw law(const NearFeatures& near) const;
    BarrierLaw law(const NearSmooth& near) const;
    Contact contact(const NearFeatures& near, double share) const;
    Contact contact(const NearSmooth& near, double share) const;
    /// Coefficients of friction of vertices, weighted, and the weight of those that have one.
    struct OwnFriction {
        double sum = 0, share = 0;
        double beside(double other) const noexcept { return share > 0 ? sum + (1 - share) * other : other; }
    };
    OwnFriction own_friction(const SurfacePoint& point) const;
    double friction(const Contact& contact, double usual) const;
    Eigen::Vector3d motion(const SurfacePoint& point) const;
    void measure(double share);
    template <class Visit>
    void for_each_near(const Visit& visit) const;

    ContactConfig config_;
    double reach_;
    PairRules rules_;
    std::vector<Body> bodies_;
    std::vector<MovingSurface> surfaces_;  // of the bodies, then of the obstacles that are meshes
    std::vector<Wall> walls_;
    double dt_ = 0, progress_ = 0;  // of the step; share of it at which the motion begins
    bool is_exact_ = false;         // see be_exact()
    bool is_guess_ = false;         // whether the motion is that of look()
    NearFeatureSearch search_;
    IntersectionSearch intersection_search_;
    std::span<const NearFeatures> near_;
    std::vector<NearSmooth> near_smooth_;
    std::vector<double> limits_, distances_, energies_, weights_;  // [near_, then near_smooth_]
    double least_distance_ = 0;
    StepReport costs_;
};

}  // namespace nbd

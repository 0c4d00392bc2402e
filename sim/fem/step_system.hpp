#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sim/fem/elastic_body.hpp"
#include "sim/fem/time_step.hpp"

namespace nbd {

/// External loads, constant over a step.
struct Loads {
    Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // m/s2
    Nodes forces;                                       // [N, 3] newtons, or empty for none
};

/// Nodes with a given velocity over the step; zero pins a node.
struct PrescribedNodes {
    std::vector<int> nodes;  // distinct rows of the node array
    Nodes v;                 // [nodes, 3], m/s
};

/// What resists that nodes of a body move apart: 1/2 |s|^2_A is its energy, where s is the sum of `factors`
/// times the displacements of the nodes.
struct NodeSpring {
    std::span<const int> nodes;       // neighbours in an element
    std::span<const double> factors;  // [nodes], with the sum 0
    Eigen::Matrix3d A;                // N/m, symmetric, >= 0
};

/// Adds what the spring's stiffness makes of v, [N, 3].
void add_pull(const NodeSpring& spring, const Nodes& v, Nodes& out);

/// The linear system A v = b of one step (see TimeStep) from (x*, v*), whose unknown is v:
///
///   A = c (1 + dt alpha) M + dt^2 / c K(x) + dt beta D
///   b = M v* + dt / c (f(x) + M g + f_outer) + dt^2 / c K(x) w
///
/// linearised at the iterate w, where x = x* + dt w; alpha and beta are the Rayleigh coefficients. In a
/// static solve a share of the mass resists, see StepStart, and alpha and beta are 0. Impulses that are added
/// to b act on the body as they are. D damps strain rates as K resists strains, and leaves
/// rotations alone, see StepMotion. For backward Euler the first w is v*, which accounts for the body's
/// rotation over the step; linearised at x*, a spinning body would gain energy. Using the last solution as w
/// gives Newton's method, with K as its only approximation (see ElasticBody).
///
/// Call assemble(), then prescribe(), then multiply() any number of times. CoupledSolver solves the systems
/// of several bodies together.
class StepSystem {
 public:
    /// The body must outlive the system.
    explicit StepSystem(const ElasticBody& body);
    explicit StepSystem(const ElasticBody&&) = delete;

    const ElasticBody& body() const noexcept { return body_; }

    /// Sets A and b and clears all prescribed nodes. w: [N, 3] m/s, or empty for start.v / c. Throws
    /// std::invalid_argument for wrong shapes or dt.
    void assemble(const StepStart& start, const TimeStep& step, const Loads& loads, const Nodes& w = {},
                  Tangent tangent = Tangent::rotated);

    /// A = mass_scale M + stiffness_scale K of the last assemble() in the rest pose, where D = K, before
    /// prescribe().
    double mass_scale() const noexcept { return mass_scale_; }
    double stiffness_scale() const noexcept { return stiffness_scale_; }

    /// Lets nodes resist changes of their velocities from w by factor [s] times `slopes` [N], N s/m,
    /// symmetric and >= 0: adds that to A, and its product with w to b. After assemble(), before prescribe().
    void resist(double factor, std::span<const Eigen::Matrix3d> slopes, const Nodes& w);

    /// Likewise by springs whose forces are known at w: factor [s2] times their stiffness. Keeps the springs,
    /// which must outlive the next assemble(), and adds to those of earlier calls.
    void stiffen(double factor, std::span<const NodeSpring> springs, const Nodes& w);

    /// Size of the impulses of loads and elasticity at the start of the step of the last assemble(): sqrt(sum
    /// |p_i|^2 / m_i), sqrt(J). It does not depend on how the body moves as a whole.
    double impulse_norm() const noexcept { return impulse_norm_; }
    /// Likewise, with the elasticity's impulses on each node times its softness(): stiff elements push many
    /// times more than they move.
    double yielding_norm() const noexcept { return yielding_norm_; }
    /// How freely a node moves, in (0, 1]. Where its neighbours stay in place, elasticity and contacts leave
    /// a share of an impulse's change of velocity: mass / (diagonal of A + `contacts` [kg]). This is a
    /// hundred times that share, at most 1.
    double softness(int node, double contacts = 0) const noexcept;

    /// Elements at the pose x = x* + dt w of the last assemble().
    const ElementPose& elements() const noexcept { return elements_; }

    /// Eliminates nodes exactly: subtracts their A v from b of the other nodes, replaces their rows and
    /// columns by those of the identity, and sets their b to v. Call once. Throws std::invalid_argument for a
    /// node out of range or named twice, or if v has the wrong shape or is not finite.
    void prescribe(const PrescribedNodes& prescribed);

    /// Adds impulses to b, before or after prescribe(). [N, 3] N s.
    void add_impulses(const Nodes& impulses);

    /// What holds the prescribed nodes at v: A v - b as they were before prescribe(), without contacts, in
    /// the order of prescribe(). [held, 3] N s. Costs little after multiply() by v.
    Nodes holding_impulses(const Eigen::Ref<const Eigen::VectorXd>& v) const;

    bool is_prescribed(int node) const noexcept { return prescribed_[node] != 0; }
    const std::vector<char>& prescribed() const noexcept { return prescribed_; }  // [N]

    /// out = A v, in double precision, element by element; out must not overlap v. Costs little if v is that
    /// of the last product, as prescribe() makes one of its velocities. Not for several threads.
    void multiply(const Eigen::Ref<const Eigen::VectorXd>& v, Eigen::Ref<Eigen::VectorXd> out) const;

    /// A to single precision; of a rigid body to double precision.
    const StepMatrix& matrix() const noexcept { return A_; }
    const Eigen::VectorXd& rhs() const noexcept { return b_; }  // [3 N], newton seconds

 private:
    void multiply_free(const Eigen::Ref<const Eigen::VectorXd>& v) const;
    Nodes product_of_free() const;

    const ElasticBody& body_;
    ElementPose elements_;
    double mass_scale_ = 0, stiffness_scale_ = 0, elastic_scale_ = 0, impulse_norm_ = 0, yielding_norm_ = 0;
    StepMatrix A_;
    Eigen::VectorXd b_;
    std::vector<Eigen::Matrix3d> resistance_;  // [N] of resist(), kg; empty: none
    std::vector<NodeSpring> springs_;          // of stiffen(), with A in kg
    std::vector<char> prescribed_;             // [N]
    std::vector<int> held_;                    // prescribed nodes in the order of prescribe()
    Nodes held_rhs_;                           // [held, 3] b there, less the shares of A of prescribed nodes
    Eigen::VectorXd shift_, shifted_;          // [3 N] scratch of prescribe()
    Nodes x_, impulse_;                        // [N, 3] scratch of assemble()
    mutable ElementForces forces_;             // scratch
    mutable Nodes free_, image_;  // [N, 3] velocities of the last product, and that with K + damping D
    mutable bool is_image_known_ = false;  // whether image_ belongs to free_
};

/// One step of a body (see TimeStep) as a minimisation over its unknown v, [N, 3]. The gradient of
///
///   P(v) = 1/c (1/2 |c v - v*|^2_M + E(x* + dt v) - dt v.(M g + f_outer))
///          + dt/2 (c alpha |v|^2_M + beta |v|^2_D)
///
/// is the impulse balance that the step solves. Joules, up to a constant. Contact forces are not included. E
/// of a rigid body is that of its linear strain: a line search along straight ways would otherwise hardly let
/// it turn.
class StepPotential {
 public:
    /// Stores references to all arguments but the step. damping: elements of the step, which define the
    /// damping matrix D.
    StepPotential(const ElasticBody& body, const StepStart& start, const TimeStep& step, const Loads& loads,
                  const ElementPose& damping)
        : body_(body), start_(start), step_(step), loads_(loads), damping_(damping) {}

    double value(const Nodes& v);
    /// E of the last value(), joules.
    double elastic_energy() const noexcept { return energy_; }

    /// [N, 3] newton seconds.
    Nodes gradient(const Nodes& v);

 private:
    const ElasticBody& body_;
    const StepStart& start_;
    TimeStep step_;
    const Loads& loads_;
    const ElementPose& damping_;
    ElementPose end_;       // scratch
    ElementForces forces_;  // likewise
    double energy_ = 0;
};

/// Weight of a node in the relative velocity of two points.
struct CouplingTerm {
    int body = 0, node = 0;
    int unknown = 0;  // row of the node's x velocity in the stacked vector
    double weight = 0;
    bool held = false;  // the node's velocity is prescribed, so it has no equation
};

/// The term J^T A J, where J v is the sum of weight times velocity over a range of terms. A is symmetric
/// positive semi-definite.
struct Coupling {
    int begin = 0, end = 0;
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
};

/// The linear system of the stacked velocities of all bodies: the matrix of each body and the couplings. A
/// view; the data must outlive it.
struct CoupledSystem {
    std::span<const StepSystem> systems;
    std::span<const int> first_unknown;  // [bodies + 1] first unknown of each body, then the total number
    std::span<const CouplingTerm> terms;
    std::span<const Coupling> couplings;

    int size() const noexcept { return first_unknown.back(); }
    int node_count() const noexcept { return size() / 3; }
    std::span<const CouplingTerm> terms_of(const Coupling& coupling) const noexcept {
        return terms.subspan(coupling.begin, coupling.end - coupling.begin);
    }

    /// out = (matrices + couplings) v. out must not overlap v.
    void multiply(const Eigen::VectorXd& v, Eigen::VectorXd& out) const;

    /// out += couplings times v.
    void add_couplings(const Eigen::VectorXd& v, Eigen::VectorXd& out) const;
};

}  // namespace nbd

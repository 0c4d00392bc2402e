#pragma once

#include <Eigen/Core>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "sim/barrier/barrier.hpp"
#include "sim/contact/friction_memory.hpp"
#include "sim/world/gases.hpp"
#include "sim/world/step_equations.hpp"
#include "sim/world/tendon_solve.hpp"
#include "sim/world/world_report.hpp"
#include "sim/world/world_state.hpp"

namespace nbd {

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

/// Finds the motion of a part of a step, of bodies that a barrier keeps apart: by one linearisation and as
/// many more as contacts need, by Newton's iteration, or as the balance of a static increment.
class PartSolve {
 public:
    /// All but `part` must outlive it.
    PartSolve(const StepPart& part, WorldState& world, StepEquations& equations, Barrier& barrier,
              TendonSolve& tendons, const FrictionMemory& friction)
        : part_(part),
          dt_(part.dt),
          world_(world),
          equations_(equations),
          barrier_(barrier),
          tendons_(tendons),
          friction_(friction) {}

    /// Solves the part so that it ends where the next can begin, anew with exact bounds where others fail. v:
    /// out, the velocities at its end; in statics the way of the increment over its length.
    Rejection run(Eigen::VectorXd& v, WorldReport& report);
    /// Of a part that is kept though it ends short of its solution: the unknowns that were solved for last,
    /// with which bodies that touch nothing go on. Else empty.
    const Eigen::VectorXd& fell_short_of() const noexcept { return fell_short_of_; }
    /// Which bodies joints caught, so that what was before the part is no guide to what comes next: [bodies].
    std::span<const char> caught() const noexcept { return caught_; }

 private:
    // part_solve.cpp
    double slip_length() const noexcept;
    Eigen::VectorXd leads() const;
    bool held_nodes_move(const std::vector<PrescribedNodes>& given) const;
    std::vector<Contact> contacts_at(const Eigen::VectorXd& v, double share, double progress,
                                     std::span<const ContactShape* const> shapes);
    double contact_error(const Eigen::VectorXd& v, std::span<const ContactShape* const> shapes);
    double trusted_share(const Eigen::VectorXd& v, const Eigen::VectorXd& to) const;
    bool goes_on_abruptly(const Eigen::VectorXd& v);
    Rejection solve(Eigen::VectorXd& v, WorldReport& report);
    void look(const Eigen::VectorXd& v, const Eigen::VectorXd& to, double progress, WorldReport& report);
    double propose(const Eigen::VectorXd& v, const Eigen::VectorXd& to, double progress, WorldReport& report);
    double search_line(const Eigen::VectorXd& v, const Eigen::VectorXd& to, double share);
    std::string end_fault(const Eigen::VectorXd& v, WorldReport& report);

    // part_energy.cpp
    /// Joules, up to a constant.
    struct BodyPotential {
        std::vector<double> terms;
        double elastic = 0;  // energy
    };
    double strain_of_turn(int body, const Eigen::VectorXd& v) const;
    double strain_of_turns(const Eigen::VectorXd& v) const;
    double inner_motion(int body, const Nodes& w) const;
    double share_of_turns(const Eigen::VectorXd& from, const Eigen::VectorXd& to) const;
    BodyPotential potential(int body, const Nodes& from, const Nodes& w) const;
    Eigen::VectorXd outer_impulses(const Eigen::VectorXd& v) const;
    bool gains_energy(int body, const Nodes& w, const Eigen::VectorXd& impulses) const;
    double share_missed(int body, const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                        const Eigen::VectorXd& impulses) const;
    bool misses_energy(const Eigen::VectorXd& from, const Eigen::VectorXd& to) const;
    bool makes_energy(const Eigen::VectorXd& v) const;

    // part_equations.cpp
    Eigen::VectorXd stacked(Nodes (*velocities)(const WorldState&, const SteppedBody&),
                            const std::vector<PrescribedNodes>& given) const;
    void find_bonds(const Eigen::VectorXd& v);
    void build_systems(const std::vector<PrescribedNodes>& given, const Eigen::VectorXd* iterate,
                       Tangent tangent);
    double residual(const Eigen::VectorXd& v);

    // balance.cpp
    /// What is out of balance at an iterate of an increment, over a body's free nodes.
    struct Imbalance {
        double off = 0, rounding = 0;  // sums of forces and of what rounding leaves of them, newtons
        double scale = 0;              // see StaticConfig::tolerance, newtons
        double net = 0;                // of the force and the torque over the body's size as a whole, newtons

        /// Relative to the scale, or to a larger one of which rounding leaves the tolerance.
        double share(double tolerance) const noexcept {
            return off > 0 ? off / std::max(scale, rounding / tolerance) : 0;
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
    std::vector<Imbalance> imbalances(const Eigen::VectorXd& v, const std::vector<PrescribedNodes>& given,
                                      bool is_assembled);
    void regularise(const Eigen::VectorXd& v, std::span<const Imbalance> imbalances, const Caution& caution);
    double room_of(int body) const;
    Rejection balance(Eigen::VectorXd& v, WorldReport& report);

    StepPart part_;
    double dt_;
    WorldState& world_;
    StepEquations& equations_;
    Barrier& barrier_;
    TendonSolve& tendons_;
    const FrictionMemory& friction_;
    GasSolve gases_;
    bool is_abrupt_ = false;      // bodies need a step that does not go on by what was before
    std::vector<char> caught_{};  // [bodies] by joints, in such a part
    Eigen::VectorXd fell_short_of_{};
};

}  // namespace nbd

#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sim/contact/bond.hpp"
#include "sim/contact/contact.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/patches/contact_shape.hpp"

namespace nbd {

/// Positions of the nodes of all bodies, and their centres of mass.
struct BodyPositions {
    std::vector<Nodes> x;
    std::vector<Eigen::Vector3d> centres;
};

/// Where impulses may act: with the nodes of all bodies at the start of a step, where those of contacts act
/// (see middle()), and at its end.
struct ImpulsePlaces {
    const BodyPositions &starts, &middles, &ends;
};

/// How the relative velocity of the two points of each contact or bond follows from the velocities of nodes:
/// the map J of each. Their numbers are those in which they were added.
class ContactTerms {
 public:
    void clear();

    /// shapes: one per body. first_unknown: start of each body's velocities in the stacked vector.
    void add(const Contact& contact, std::span<const ContactShape* const> shapes,
             std::span<const int> first_unknown);

    void add(const Bond& bond, std::span<const int> first_unknown);

    /// Notes which nodes have prescribed velocities.
    void hold(std::span<const StepSystem> systems);

    std::span<const CouplingTerm> all() const noexcept { return terms_; }
    std::span<const CouplingTerm> of(std::size_t contact) const noexcept {
        return std::span(terms_).subspan(begin_[contact], begin_[contact + 1] - begin_[contact]);
    }
    /// The coupling of the contact's nodes by a matrix.
    Coupling coupling(std::size_t contact, const Eigen::Matrix3d& A) const noexcept {
        return {static_cast<int>(begin_[contact]), static_cast<int>(begin_[contact + 1]), A};
    }

    /// J v: velocity of the contact's point a relative to b.
    Eigen::Vector3d velocity(std::size_t contact, const Eigen::VectorXd& v) const;

    /// out += J^T p. held: whether nodes with prescribed velocities take part.
    void add_impulse(std::size_t contact, const Eigen::Vector3d& p, bool held, Eigen::VectorXd& out) const;

    /// The bodies of the points a and b; -1: an obstacle or the world.
    const std::array<int, 2>& bodies(std::size_t contact) const noexcept { return bodies_[contact]; }

    /// Where the impulse between two bodies acts: halfway between the two points, so that the pair does not
    /// turn by itself; at the point of a body where the other is no body's.
    Eigen::Vector3d acts_at(std::size_t contact, const BodyPositions& at) const;

    /// Adds what the impulse p on the point a, and -p on b, gives to the momenta of the bodies.
    void add_momentum(std::size_t contact, const Eigen::Vector3d& p, const BodyPositions& at,
                      std::vector<Momentum>& momenta) const;

 private:
    void add_point(const SurfacePoint& point, double sign, std::span<const ContactShape* const> shapes,
                   std::span<const int> first_unknown);

    void add_term(int body, int node, double weight, std::ptrdiff_t begin,
                  std::span<const int> first_unknown);

    std::vector<CouplingTerm> terms_;
    std::vector<std::array<int, 2>> bodies_;
    std::vector<std::size_t> begin_{0};  // [contacts + 1] range of each contact
};

}  // namespace nbd

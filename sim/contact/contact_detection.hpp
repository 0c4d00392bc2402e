#pragma once

#include <array>
#include <map>
#include <span>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "collision/query/sweep.hpp"
#include "sim/contact/body_contact.hpp"
#include "sim/contact/contact_reduction.hpp"
#include "sim/contact/self_contact.hpp"
#include "sim/fem/elastic_body.hpp"
#include "sim/fem/step_report.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/obstacles/obstacle.hpp"

namespace nbd {

/// A body as seen by contact detection. Surface and tree must be up to date with the state.
struct ContactParty {
    const ElasticBody& elastic;
    const BodyState& state;
    const ContactSurface& surface;
    double young = 0;           // modulus of its outer layer, Pa
    PosedTree* tree = nullptr;  // null: contacts with obstacles only, not with bodies
    double moved = 0;           // metres that it moved in the last step, if its velocities do not tell
};

/// Finds all contacts of a step. Obstacles: by signed distance. Bodies: a sweep over their boxes, then their
/// trees down to patches of the surfaces, then vertices with faces and edges with edges. A body with itself,
/// if the config asks for it: a query of its tree with itself. Gaps of contacts that were near each other at
/// the start are measured from there, see StartDepths.
class ContactDetection {
 public:
    /// Fills contacts(). time: time of the states, seconds. dt: length of the step that starts there.
    /// dt_before: length of the previous step, 0 if there was none. thickness: metres. report: its counts and
    /// times grow.
    void find(std::span<const ContactParty> bodies, std::span<const Obstacle> obstacles,
              const ContactConfig& config, double thickness, double time, double dt_before, double dt,
              StepReport& report);

    /// Contacts of the last find(), in an order determined by the bodies and their states.
    std::span<const Contact> contacts() const noexcept { return contacts_; }
    /// Largest overlap of vertices and edges that make contact, contacts left out included, metres, >= 0.
    double deepest() const noexcept { return deepest_; }
    /// The most that two nearby bodies may approach each other within the step, metres.
    double approach() const noexcept { return approach_; }

    /// The state that the next find() depends on besides its arguments.
    ContactSides sides() const;
    void restore(const ContactSides& sides);

 private:
    void find_obstacles(std::span<const ContactParty> bodies, std::span<const Obstacle> obstacles,
                        const ContactConfig& config, double thickness, double time, double dt);
    std::span<const PatchPair> near_patches(const ContactParty& a, const ContactParty& b,
                                            const ContactReach& reach, double dt, StepReport& report);
    void find_bodies(BodyIndices pair, std::span<const ContactParty> bodies, const ContactConfig& config,
                     double thickness, double dt_before, double dt, StepReport& report);

    SelfContactFinder& self_finder(int body, const ContactParty& party, double thickness);
    void find_self(int body, std::span<const ContactParty> bodies, const ContactConfig& config,
                   double thickness, double dt_before, double dt, StepReport& report);
    void yield_to_starts(std::size_t first, std::array<int, 2> pair, double thickness);
    void finish_bodies(std::size_t first, BodyIndices pair, std::span<const ContactParty> bodies,
                       const ContactConfig& config, double thickness, double stiffness);

    std::map<BodyIndices, BodyContactFinder> finders_;  // pairs whose boxes touched in the last find()
    std::map<int, SelfContactFinder> self_finders_;
    std::map<int, VertexSides> self_sides_;  // of bodies with themselves
    using ByVertex = std::map<std::array<int, 3>, double>;
    ByVertex starts_, starts_now_;  // see StartDepths: of the last find(), and of this one
    int started_bodies_ = 0, started_obstacles_ = 0;
    Sweep sweep_;
    PairQuery query_;
    std::vector<ContactSurface::Ball> block_velocities_a_, block_velocities_b_;
    PosedPatches posed_a_, posed_b_;
    std::vector<PatchPair> patch_pairs_;
    ContactReduction reduction_;
    std::vector<Contact> contacts_;
    double deepest_ = 0, approach_ = 0;
};

}  // namespace nbd

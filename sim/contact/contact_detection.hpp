#pragma once

#include <map>
#include <span>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "collision/query/sweep.hpp"
#include "sim/contact/body_contact.hpp"
#include "sim/contact/obstacle.hpp"
#include "sim/fem/elastic_body.hpp"
#include "sim/fem/step_system.hpp"

namespace nbd {

/// A body as others may touch it: its surface and tree are those of the state.
struct ContactParty {
    const ElasticBody& elastic;
    const BodyState& state;
    const ContactSurface& surface;
    PosedTree* tree = nullptr;  // null: meets obstacles only, never bodies
};

/// What a search for contacts met and cost.
struct DetectionReport {
    long face_pairs = 0;          // of two bodies, close enough to be looked at
    long nodes_bounded = 0;       // spheres of collision trees computed
    long nodes_out_of_range = 0;  // of them exactly, their input being out of the calibrated range
    double update_us = 0;         // microseconds to start the trees' poses
    double collision_us = 0;      // microseconds of the queries for face pairs
    double approach = 0;  // metres by which two bodies near each other may come closer within the step
};

/// Finds all contacts of a step: of bodies with obstacles, by signed distance, and of bodies with each other:
/// a sweep over their boxes, their trees down to face pairs, then vertices with faces and edges with edges.
/// A body's contact with itself would be one more finder, on the pair (b, b), fed by a query of its tree with
/// itself that leaves out faces which share a vertex.
class ContactDetection {
 public:
    /// Fills contacts(). time: of the bodies' states, seconds; dt: of the step from there; dt_before: of the
    /// step to there, 0 where there was none. thickness: metres.
    void find(std::span<const ContactParty> bodies, std::span<const Obstacle> obstacles,
              const ContactConfig& config, double thickness, double time, double dt_before, double dt,
              DetectionReport& report);

    /// Of the last find(), in an order that the bodies and their states determine.
    std::span<const Contact> contacts() const noexcept { return contacts_; }
    double deepest() const noexcept;  // metres of overlap among contacts(), >= 0

    /// What the next find() depends on besides its arguments.
    ContactSides sides() const;
    void restore(const ContactSides& sides);

 private:
    void find_obstacles(std::span<const ContactParty> bodies, std::span<const Obstacle> obstacles,
                        const ContactConfig& config, double thickness, double time, double dt);
    void find_bodies(BodyIndices pair, std::span<const ContactParty> bodies, const ContactConfig& config,
                     double thickness, double dt_before, double dt, DetectionReport& report);

    std::map<BodyIndices, BodyContactFinder> finders_;  // pairs whose boxes touched in the last find()
    Sweep sweep_;
    PairQuery query_;
    std::vector<Contact> contacts_;
};

}  // namespace nbd

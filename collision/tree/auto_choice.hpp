#pragma once

#include <limits>

namespace nbd {

/// What queries with one kind of bounds cost a body, as measured on it. Their work is counted, in nodes
/// bounded and pairs of leaves, so that the cost of a later pose follows from counts, without a clock.
struct BoundsCost {
    double start_ns = std::numeric_limits<double>::infinity();  // to begin a pose; infinite: not measured
    double work_ns = 0;                                         // per unit of work
    double measured_work = 0;                                   // greatest work of a trial
    double work = 0;  // expected of the next pose: a running mean over poses

    /// Of a pose with so much work, ns.
    double of_pose(double work_done) const noexcept { return start_ns + work_ns * work_done; }
    double of_next_pose() const noexcept { return of_pose(work); }
};

/// The choice of `auto` bounds between `boxes` and learned ones, for one body. Both are measured on the
/// body in its first poses that may touch another, a few times, and these prices are kept; from then on
/// counts of work decide. Both are tried again once the poses since the last trial cost fifty times as much
/// as a trial.
///
/// A plain value: a simulator that keeps it with its own state continues with the same choices.
struct AutoChoice {
    static constexpr int first_trials = 8;
    static constexpr double share_of_trials = 0.02;  // of the time, after the first ones
    static constexpr double share_of_pose = 0.25;    // in running means

    BoundsCost boxes, learned;
    double learned_per_boxes =
        1;  // work of learned boxes over that of exact ones: a running mean over trials
    int trials = 0;
    double since_trial_ns = 0;

    /// Whether the next query should use both kinds and measure them.
    bool is_trial_due() const noexcept;

    /// What a pose took with one kind: time to begin it, and time and work, >= 0, of its queries.
    struct Trial {
        double start_ns = 0, query_ns = 0, work = 0;
    };
    /// Takes what the same queries took with both kinds.
    void take_trial(const Trial& boxes, const Trial& learned) noexcept;

    /// Takes the work of a pose's queries with each kind.
    void take_pose(double boxes_work, double learned_work) noexcept;

 private:
    double share() const noexcept { return trials == 0 ? 1 : share_of_pose; }
    void expect(double boxes_work, double learned_work) noexcept;
};

/// Whether a trial on two bodies uses learned boxes first: unless exact ones are expected to cost less. The
/// first kind alone answers for bodies that it finds apart; the second finds caches that hold what both read,
/// so that the lead of the first is no gift of the caches.
inline bool learned_goes_first(const AutoChoice& a, const AutoChoice& b) noexcept {
    return !(a.boxes.of_next_pose() + b.boxes.of_next_pose() <
             a.learned.of_next_pose() + b.learned.of_next_pose());
}

/// Whether learned boxes are cheaper for two bodies together. They are not before the first trial.
inline bool learned_is_cheaper(const AutoChoice& a, const AutoChoice& b) noexcept {
    return a.learned.of_next_pose() + b.learned.of_next_pose() <
           a.boxes.of_next_pose() + b.boxes.of_next_pose();
}

}  // namespace nbd

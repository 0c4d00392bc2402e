#pragma once

#include <deque>
#include <vector>

#include "apps/view/posed_view.hpp"
#include "apps/view/view_scene.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"
#include "sim/obstacles/obstacle.hpp"

namespace nbd {

/// Finds the faces that a page marks, by the exact queries of the collision library.
class ContactFinder {
 public:
    /// distance: of faces that are near, metres; 0: only intersecting ones are sought. self_contact: whether
    /// a body meets itself. rest: [bodies] surfaces at rest, for that; else not read.
    ContactFinder(double distance, bool self_contact, std::vector<Obstacle> obstacles,
                  const std::vector<Vertices>& rest, const std::deque<PosedView>& bodies);

    /// Appends the faces of a frame to the marks of `shown`. bodies: in their poses. time: seconds.
    PairCounts add_frame(std::deque<PosedView>& bodies, double time, std::vector<ViewBody>& shown);

 private:
    struct Marked {
        std::vector<std::uint32_t> near, intersecting, missed;
    };
    void meet(PosedView& a, PosedView& b, Marked& of_a, Marked& of_b, PairCounts& counts);
    void meet_itself(PosedView& body, std::size_t index, Marked& marked, PairCounts& counts);
    void meet_obstacles(const PosedView& body, double time, Marked& marked) const;

    float distance_;
    std::vector<Obstacle> obstacles_;
    std::vector<SelfQuery> self_;       // [bodies]; empty: bodies do not meet themselves
    std::vector<float> self_distance_;  // [bodies]
    PairQuery exact_, own_;
};

}  // namespace nbd

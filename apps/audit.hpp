#pragma once

#include <memory>
#include <vector>

#include "collision/pair_query.hpp"
#include "sim/scene.hpp"
#include "sim/world.hpp"

namespace nbd {

/// Face pairs that exact bounds find, and how many of them a scene's own bounds miss.
struct AuditCount {
    long intersecting = 0, intersecting_missed = 0;
    long near = 0, near_missed = 0;  // within the thickness at which contact begins
    AuditCount& operator+=(const AuditCount& other);
};

/// Asks a scene's bounds and exact ones the same questions about the same poses, beside the simulation and
/// without touching it.
class Audit {
 public:
    /// bodies: as they went into build_world(). Bodies without a tree file have exact bounds in both.
    Audit(const SceneSpec& spec, const std::vector<LoadedBody>& bodies);

    /// All pairs of bodies in their current poses.
    AuditCount check(World& world);

 private:
    std::vector<PosedTree> scene_, exact_;  // [bodies]
    PairQuery scene_query_, exact_query_;
};

}  // namespace nbd

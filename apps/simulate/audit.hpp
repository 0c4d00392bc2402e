#pragma once

#include <memory>
#include <span>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "sim/scene/scene.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// Face pairs that exact bounds find, and how many of them a scene's own bounds miss; what both cost.
struct AuditCount {
    long intersecting = 0, intersecting_missed = 0;
    long near = 0, near_missed = 0;   // within the thickness at which contact begins
    long tests = 0, exact_tests = 0;  // of spheres, boxes and triangles, by the scene's bounds and exact ones
    double us = 0, exact_us = 0;      // microseconds, measured: poses begun and both queries
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
    /// Trees of all bodies with one choice of bounds, and how they answered the last question.
    struct Side {
        std::vector<PosedTree> trees;  // [bodies]
        PairQuery query{};
        double us = 0;
        long tests = 0;

        void begin_poses(World& world);
        std::span<const FacePair> intersecting(std::size_t a, std::size_t b);
        std::span<const FacePair> within(std::size_t a, std::size_t b, float distance);
        template <class Question>
        auto measured(const Question& question);
    };

    Side scene_, exact_;
};

}  // namespace nbd

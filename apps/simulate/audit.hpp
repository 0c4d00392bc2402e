#pragma once

#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "sim/scene/scene.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// Face pairs that exact bounds find, how many of them a scene's own bounds miss, and the cost of both.
struct AuditCount {
    long near = 0, near_missed = 0;   // within the thickness at which contact begins
    long tests = 0, exact_tests = 0;  // tests of spheres, boxes, triangles: scene's bounds, exact bounds
    double us = 0, exact_us = 0;      // measured microseconds: begin_pose() and the queries
    AuditCount& operator+=(const AuditCount& other);
};

/// Names of these numbers in tables and --json, in the order of the columns.
struct AuditNumber {
    const char* name;
    std::variant<long AuditCount::*, double AuditCount::*> member;
};
inline constexpr AuditNumber audit_numbers[] = {
    {"near_pairs", &AuditCount::near},   {"near_pairs_missed", &AuditCount::near_missed},
    {"audit_tests", &AuditCount::tests}, {"audit_exact_tests", &AuditCount::exact_tests},
    {"audit_us", &AuditCount::us},       {"audit_exact_us", &AuditCount::exact_us},
};

/// Runs the same queries on the same poses with a scene's bounds and with exact ones. Does not affect the
/// simulation.
class Audit {
 public:
    /// bodies: as passed to build_world().
    Audit(const SceneSpec& spec, const std::vector<LoadedBody>& bodies);

    /// Checks all pairs of bodies in their current poses.
    AuditCount check(World& world);

 private:
    /// The surface of a body with `affine` bounds in the positions that these compute from its nodes. They
    /// may differ from World::surface() by rounding, which decides whether faces touch that just touch.
    struct HungSurface {
        SurfaceEmbedding W;  // empty for other bounds
        Vertices x{};
    };

    /// Trees of all bodies with one choice of bounds, and the cost of their queries.
    struct Side {
        std::vector<PosedTree> trees;  // [bodies]
        PairQuery query{};
        double us = 0;
        long tests = 0;

        /// hung: see Audit::hung_.
        void begin_poses(World& world, std::vector<HungSurface>& hung);
        std::span<const FacePair> within(std::size_t a, std::size_t b, float distance);
    };

    std::vector<HungSurface> hung_;  // [bodies]
    Side scene_, exact_;
};

}  // namespace nbd

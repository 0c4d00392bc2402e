#pragma once

#include <deque>
#include <string>
#include <vector>

#include "apps/simulate/audit.hpp"
#include "apps/simulate/step_table.hpp"
#include "sim/scene/scene.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// Whether all bodies of the scene can have bounds of this kind. bodies: as passed to build_world().
bool can_have(const SceneSpec& spec, const std::vector<LoadedBody>& bodies, BoundKind kind);

/// Runs a scene once with each of several kinds of bounds; its margins apply to those that can miss. The runs
/// take turns step by step, so that slow moments of the machine hit all of them.
class BoundsRace {
 public:
    /// The results with one kind of bounds.
    struct Row {
        BoundKind bounds;
        StepTotals totals;
        double farthest = 0;  // distance of a node from its place in the first run, metres
    };

    /// bodies: as passed to build_world(). kinds: at least one. Throws what build_world() throws where a body
    /// cannot have a kind.
    BoundsRace(const SceneSpec& spec, const std::vector<LoadedBody>& bodies,
               const std::vector<BoundKind>& kinds);

    /// Takes the steps of the next frame in every run. audited: counts the pairs of faces that bounds miss,
    /// of kinds that can miss. Throws std::runtime_error, naming the bounds, where a run fails.
    void run_frame(bool audited);

    std::vector<Row> rows() const;
    double size() const { return runs_.front().world.smallest_diagonal(); }  // metres

 private:
    struct Run {
        Run(const SceneSpec& spec, const std::vector<LoadedBody>& bodies, BoundKind kind);
        BoundKind bounds;
        World world;
        Audit audit;
        StepTable table;
    };

    const SceneSpec& spec_;
    int frame_ = 0;
    std::deque<Run> runs_;
};

/// A table for people. size: that distances are compared with, metres.
std::string to_text(const std::vector<BoundsRace::Row>& rows, double size);

/// CSV, one line for each kind: means per step in microseconds, counts of all audited frames, metres.
std::string to_csv(const std::vector<BoundsRace::Row>& rows);

}  // namespace nbd

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/simulate/film.hpp"
#include "apps/simulate/simulation_frame.hpp"
#include "meshing/formats/vtu.hpp"
#include "sim/scene/scene.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// Everything that a run writes beside its journal, made from frames alone: the same frames give the same
/// files, whether they were just simulated or read from a journal.
class SimulationOutputs {
 public:
    /// paths: as the run writes them; empty ones are not written. world: as it begins;
    /// read during calls, must outlive this. body_hashes: one a body. Removes what killed runs with these
    /// paths left half-written.
    SimulationOutputs(const SceneOutput& paths, const SceneSpec& spec, const World& world,
                      const std::vector<std::string>& body_hashes);

    /// Frames come in order, from 0 on.
    void add_frame(const SimulationFrame& frame);
    /// Steps after the last frame that led to none.
    void add_steps(const std::vector<StepRow>& steps) { table_.add(steps); }
    /// failure: why the simulation ended too soon; empty: it did not.
    void finish(const std::string& failure);

    const StepTable& table() const noexcept { return table_; }

 private:
    void add_to_recording(const SimulationFrame& frame);
    void add_vtu(const SimulationFrame& frame);
    void add_surfaces(const SimulationFrame& frame);

    SceneOutput paths_;
    const World& world_;
    std::vector<std::string> names_;  // [bodies] of .obj files
    RecordingWriter recording_;
    std::vector<int> handles_;  // [bodies]
    std::vector<Nodes> start_;  // [bodies]
    std::optional<VtuSeries> vtu_;
    Film film_;
    StepTable table_;
};

}  // namespace nbd

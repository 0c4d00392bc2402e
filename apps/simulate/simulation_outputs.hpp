#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/extras/contact_edges.hpp"
#include "apps/extras/extras_request.hpp"
#include "apps/simulate/film.hpp"
#include "apps/simulate/simulation_frame.hpp"
#include "meshing/formats/vtu.hpp"
#include "sim/scene/scene.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// What a recording holds besides the bodies' motion.
struct RecordingExtras {
    std::filesystem::path
        scene_file{};       // where the scene was read; stored relative to the recording; may be empty
    std::string options{};  // run_options_text() of the run; may be empty
    ExtrasRequest of_frames{};
};

/// Name of the recording's label with the path of the scene file, relative to the recording's folder.
inline constexpr const char* scene_file_label = "scene_file";

/// Unique name that is safe in file names: "1_upper_ring" for body 1 with the name "upper ring". name: UTF-8,
/// whose letters beyond ASCII are kept.
std::string body_file_name(std::size_t body, std::string name);

/// Everything that a run writes except its journal. Made from frames alone, so that the same frames give the
/// same files, whether they were just simulated or read from a journal.
class SimulationOutputs {
 public:
    /// paths: of the outputs; empty ones are not written. spec, world: at the start; read during calls, must
    /// outlive this object. body_hashes: one per body. Removes temporary files that killed runs left at these
    /// paths.
    SimulationOutputs(const SceneOutput& paths, const SceneSpec& spec, const World& world,
                      const std::vector<std::string>& body_hashes, const RecordingExtras& extras = {});

    /// Adds a frame. Call in order, starting with frame 0.
    void add_frame(const SimulationFrame& frame);
    /// Adds steps after the last frame that did not complete another frame.
    void add_steps(const std::vector<StepRow>& steps, const std::vector<StepReactions>& reactions);
    /// Writes and closes the files. failure: why the simulation ended early; empty if it did not.
    void finish(const std::string& failure);

    const StepTable& table() const noexcept { return table_; }

 private:
    void add_to_recording(const SimulationFrame& frame);
    void tell_rounding(std::size_t body, VerticesRef nodes);
    void add_vtu(const SimulationFrame& frame);
    void add_surfaces(const SimulationFrame& frame);

    SceneOutput paths_;
    const SceneSpec& spec_;
    const World& world_;
    std::vector<std::string> names_;  // [bodies] stems of .obj files
    RecordingWriter recording_;
    std::vector<int> handles_;  // [bodies]
    ExtrasRequest extras_;
    std::optional<ContactEdgeFinder> contact_edges_;  // if they are asked for
    std::vector<std::int32_t> troubled_;              // [frames] see FrameFacts
    std::vector<std::string> labels_;                 // [bodies] for messages
    std::vector<double> edges_;  // [bodies] mean edge of the surface at rest, metres; infinite once told of
    std::vector<Nodes> start_;   // [bodies]
    std::optional<VtuSeries> vtu_;
    Film film_;
    StepTable table_;
    std::optional<ReactionTable> reactions_;  // if it is asked for
};

}  // namespace nbd

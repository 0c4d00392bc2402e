#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/cli/output.hpp"
#include "apps/live/run_page.hpp"
#include "apps/simulate/audit.hpp"
#include "apps/simulate/draw_scene.hpp"
#include "apps/simulate/journal.hpp"
#include "apps/simulate/run_files.hpp"
#include "apps/simulate/simulation_outputs.hpp"

namespace nbd {

/// What a run of a scene is asked for.
struct SimulateOptions {
    std::string scene;     // its file
    SceneDraw draw{};      // of a scene with variables
    SceneOutput output{};  // empty paths: the scene's
    // Instead of the scene's: bounds of all bodies, their margin, number of frames.
    std::optional<BoundKind> bounds{};
    std::optional<double> margin{};
    std::optional<int> frames{};
    int audit = 0;               // every so many frames; 0: never
    std::optional<int> live{};   // port of the page that shows the run; 0: any
    bool keep_live = false;      // whether the page is served after the end
    bool resume = false;         // continue an earlier run, or leave a finished one as it is
    bool allow_outside = false;  // whether the scene may name outputs outside of the recording's folder
    ExtrasRequest extras{};
};

/// The loop of a run, step after step, with a page that shows it or without: from the scene's file to the
/// recording and the other outputs, with a journal from which a run that was stopped or killed continues.
class RunLoop {
 public:
    /// Reads the scene and checks the outputs. Throws one line about the first thing that is wrong.
    RunLoop(SimulateOptions options, Output& out);

    /// Runs the scene to its end. Throws std::runtime_error where it fails, and Interrupted where the user
    /// stops it.
    void run();

 private:
    void override_scene();
    bool is_finished() const;
    void open_journal();
    std::vector<std::string> load();
    void begin(const std::vector<std::string>& body_hashes);
    void make_frame();
    void note(const WorldReport& report);
    void keep(int number, std::vector<StepRow> steps, std::vector<StepReactions> reactions);
    void end();
    void end_page(bool stopped);
    std::string how_to_continue() const;

    SimulateOptions options_;
    Output& out_;
    SceneSpec spec_;         // with what the options override
    RunOptions overridden_;  // what the options change of a run
    std::vector<std::filesystem::path> inputs_;
    SceneOutput paths_;
    std::optional<RunPage> page_;
    std::optional<Journal> journal_;
    std::shared_ptr<World> world_;  // shared with the page of the run, which another thread makes
    std::optional<Audit> audit_;
    std::optional<SimulationOutputs> outputs_;
    SimulationFrame frame_;          // the last one
    std::string failure_, trouble_;  // why the run ends; the first trouble of its steps
    int factorised_ = 0;             // steps whose linear systems were factorised
    int frames_made_ = 0;            // by this run
    double output_us_ = 0;           // their outputs, journal included
};

}  // namespace nbd

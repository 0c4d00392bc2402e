#include "apps/simulate/run_loop.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "apps/cli/interrupt.hpp"
#include "apps/cli/load_body.hpp"
#include "apps/simulate/run_report.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/h5/sha256.hpp"
#include "meshing/h5/version.hpp"
#include "meshing/surface/counted.hpp"
#include "sim/factor/blas.hpp"
#include "training/files/recording.hpp"
#include "training/files/split.hpp"

namespace nbd {
namespace {

std::string text_of(const auto& option) { return option ? fmt::format("{}", *option) : ""; }

/// Everything that determines what a run computes.
Journal::Facts facts_of(const RunOptions& options, const SceneSpec& spec) {
    Journal::Facts facts{
        {"program version", std::string(version())},
        {"scene", h5::text_sha256(spec.text)},
        {"--frames", fmt::format("{}", spec.time.frames)},
    };
    facts.insert(facts.end(), options.begin(), options.end());
    for (const std::filesystem::path& input : scene_inputs(spec))
        facts.emplace_back(input.filename().string(), h5::file_sha256(input));
    return facts;
}

}  // namespace

RunLoop::RunLoop(SimulateOptions options, Output& out) : options_(std::move(options)), out_(out) {
    hold_blas_to_one_thread();
    if (const BlasInfo blas = blas_info(); !blas.fast) out.warning(blas.warning);
    spec_ = load_scene(options_.scene, options_.draw, out);
    override_scene();
    inputs_ = scene_inputs(spec_);
    inputs_.push_back(options_.scene);
    paths_ = output_paths(options_.output, spec_.output, options_.scene, options_.allow_outside);
    check_outputs(paths_, inputs_);
}

void RunLoop::override_scene() {
    const auto& bounds = options_.bounds;
    const auto& margin = options_.margin;
    overridden_ = {{"--bounds", bounds ? std::string(name(*bounds)) : ""},
                   {"--margin", text_of(margin)},
                   {"--audit", options_.audit > 0 ? fmt::format("{}", options_.audit) : ""}};
    if (options_.frames && spec_.time.statics)
        overridden_.emplace_back("--frames", fmt::format("{}", *options_.frames));
    for (SceneBody& body : spec_.bodies) {
        if (bounds) body.bounds = *bounds;
        if (margin) body.margin = margin;
    }
    if (options_.frames) spec_.time.set_frames(*options_.frames);
}

/// Whether an earlier run has done all. Warns of what is asked of a run that is not made.
bool RunLoop::is_finished() const {
    const EarlierRun earlier = find_earlier_run(paths_, {spec_, inputs_, options_.extras, overridden_});
    if (!earlier.is_finished) return false;
    RunOptions idle = earlier.tells_options ? RunOptions() : overridden_;
    idle.emplace_back("--live", options_.live ? "given" : "");
    if (const std::string given = given_options(idle); !given.empty())
        out_.warning(
            fmt::format("{}: the run is finished, so it ignores {}", paths_.recording.string(), given));
    if (out_.strict)
        if (const int frames = troubled_frames(RecordingReader(paths_.recording)); frames > 0)
            throw std::runtime_error(fmt::format("{}: the run is finished, with {} of steps that went wrong",
                                                 paths_.recording.string(), counted(frames, "frame")));
    out_.text(fmt::format("{}: is finished, nothing to continue; without --resume the scene runs anew",
                          paths_.recording.string()));
    out_.result({{"finished", true}});
    return true;
}

std::string RunLoop::how_to_continue() const {
    return fmt::format("continue with: {}{}", out_.command_line, options_.resume ? "" : " --resume");
}

void RunLoop::open_journal() {
    journal_.emplace(journal_path(paths_), facts_of(overridden_, spec_), options_.resume);
    say_on_interrupt(
        fmt::format("{} holds the frames done; {}", journal_path(paths_).string(), how_to_continue()));
}

void RunLoop::run() {
    if (options_.resume && is_finished()) return;
    if (options_.live) page_.emplace(*options_.live);
    // A new journal has to wait, so that a run that is stopped while it loads leaves nothing behind.
    if (options_.resume && std::filesystem::exists(journal_path(paths_))) open_journal();
    begin(load());
    while (frame_.number < spec_.time.frames && failure_.empty() && !interrupted()) make_frame();
    end();
}

/// Makes the world. Returns the hashes of its bodies.
std::vector<std::string> RunLoop::load() {
    out_.work("loading");
    std::vector<LoadedBody> bodies = load_bodies(spec_, out_);
    std::vector<std::string> hashes;
    for (const LoadedBody& body : bodies) hashes.push_back(body_hash(*body.body));
    make_trees(spec_, bodies);
    std::vector<StartMove> moves;
    world_ = std::make_shared<World>(build_world(spec_, bodies, &moves));
    tell_start(options_.scene, spec_, bodies, *world_, moves, out_);
    world_->check_start();
    if (options_.audit > 0) audit_.emplace(spec_, bodies);
    if (page_) page_->begin(spec_, bodies, world_, paths_.recording.filename().string());
    return hashes;
}

/// Passes the frames of an earlier run to the outputs and continues after them, or keeps the start.
void RunLoop::begin(const std::vector<std::string>& body_hashes) {
    finish_on_interrupt();
    if (!journal_) open_journal();
    outputs_.emplace(paths_, spec_, *world_, body_hashes,
                     RecordingExtras{.scene_file = options_.scene,
                                     .options = run_options_text(overridden_),
                                     .of_frames = options_.extras});
    bool continues = false;
    while (const auto record = journal_->next()) {
        continues = true;
        frame_ = frame_from(*record);
        outputs_->add_frame(frame_);
        if (page_) page_->add(frame_.number, frame_.world, frame_.contact_forces, last_reactions(frame_));
    }
    if (continues) {
        world_->restore(frame_.world);
        out_.text(fmt::format("{}: continues after frame {}", paths_.recording.string(), frame_.number));
    } else {
        keep(0, {}, {});
    }
    if (page_) out_.announcement(fmt::format("{} shows the run", page_->url()));
    if (out_.strict && outputs_->table().totals().troubled_steps > 0)
        failure_ = fmt::format("a step up to frame {} went wrong", frame_.number);
    out_.progress("frames", frame_.number, spec_.time.frames);
}

/// Takes the steps of the next frame and keeps it, unless one fails.
void RunLoop::make_frame() {
    const int number = frame_.number + 1;
    std::vector<StepRow> steps;
    std::vector<StepReactions> reactions;
    for (int step = 0; step < spec_.time.steps_per_frame && failure_.empty(); ++step) {
        const WorldReport report = world_->step(spec_.time.dt);
        steps.push_back({report, number});
        reactions.push_back({number, report.time, world_->reactions()});
        note(report);
    }
    if (!failure_.empty()) return outputs_->add_steps(steps, reactions);
    if (audit_ && number % options_.audit == 0) steps.back().audit = audit_->check(*world_);
    keep(number, std::move(steps), std::move(reactions));
    out_.progress("frames", number, spec_.time.frames);
}

/// Takes down what went wrong in a step, and whether it ends the run.
void RunLoop::note(const WorldReport& report) {
    failure_ = report.failure;
    if (spec_.time.statics && report.substeps > 1 && failure_.empty())
        out_.warning(fmt::format("the increment to {:.6g} of the load was taken in {} parts, {}", report.time,
                                 report.substeps, report.rejection));
    if (trouble_.empty() && report.trouble != StepTrouble::inverted) trouble_ = report.trouble_reason;
    if (out_.strict && failure_.empty()) failure_ = report.trouble_reason;
    if (report.fallback.empty() || factorised_++ > 0) return;
    const std::string line = fmt::format("a linear system was factorised, {}", report.fallback);
    if (!out_.strict)
        out_.warning(line);
    else if (failure_.empty())
        failure_ = line;
}

/// Passes a frame of the world to the journal, the outputs and the page.
void RunLoop::keep(int number, std::vector<StepRow> steps, std::vector<StepReactions> reactions) {
    const ScopedTimer timer(output_us_);
    frame_ = take_frame(number, *world_, std::move(steps), std::move(reactions));
    journal_->append(to_bytes(frame_));
    outputs_->add_frame(frame_);
    if (page_) page_->add(frame_.number, frame_.world, frame_.contact_forces, last_reactions(frame_));
    ++frames_made_;
}

void RunLoop::end() {
    if (factorised_ > 1) out_.warning(fmt::format("linear systems were factorised in {} steps", factorised_));
    outputs_->finish(failure_);
    const bool stopped = failure_.empty() && frame_.number < spec_.time.frames;
    if (!stopped) journal_->remove();
    const StepTotals totals = outputs_->table().totals();
    // A strict run that met trouble ends with that as its error.
    if (!(out_.strict && !failure_.empty())) tell_trouble(totals, trouble_, out_);
    tell_results(paths_, spec_.time.statics.has_value(), frame_.number, totals, world_->smallest_diagonal(),
                 output_us_ / std::max(frames_made_, 1), out_);
    if (page_) end_page(stopped);
    if (!failure_.empty())
        throw std::runtime_error(fmt::format("{}: stopped at {:.4g} {}: {}", options_.scene, world_->time(),
                                             spec_.time.statics ? "of the load" : "s", failure_));
    if (stopped)
        throw Interrupted(fmt::format("{} holds the {} of {} frames done; {}", paths_.recording.string(),
                                      frame_.number, spec_.time.frames, how_to_continue()));
}

/// Shows the end of the run, and goes on serving if that was asked for.
void RunLoop::end_page(bool stopped) {
    const bool failed = !failure_.empty();
    page_->end(stopped ? RunState::stopped : failed ? RunState::failed : RunState::done, failure_);
    if (!options_.keep_live || stopped) return;
    out_.announcement(fmt::format("the run has {}; {} shows it until Ctrl-C",
                                  failed ? "failed: " + failure_ : "ended", page_->url()));
    page_->keep_serving();
}

}  // namespace nbd

#include "apps/simulate/run_report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "apps/simulate/run_files.hpp"
#include "meshing/surface/counted.hpp"
#include "sim/scene/scene_check.hpp"
#include "sim/world/start_check.hpp"

namespace nbd {
namespace {

/// Where the time of a step went, in ms and as a share of the step.
std::string time_line(const StepTotals& total, double output_us) {
    const double step_us = total.step_us();
    const auto part = [&](double us) {
        return fmt::format("{:.2f} ({:.1f} %)", 1e-3 * us, 100 * us / std::max(step_us, 1e-3));
    };
    return fmt::format(
        "time per step: {:.2f} ms: search {}, detection {}, assembly {}, solve {}, rest {}; "
        "output {:.2f} ms a frame",
        1e-3 * step_us, part(total.search_us()), part(total.mean(&StepReport::detect_us)),
        part(total.mean(&StepReport::assemble_us)), part(total.mean(&StepReport::solve_us)),
        part(total.mean(&StepReport::rest_us)), 1e-3 * output_us);
}

nlohmann::ordered_json to_json(const StepTotals& total, int frames, double size, double output_us) {
    const StepReport& all = total.all;
    nlohmann::ordered_json json = {{"frames", frames},
                                   {"steps", total.steps},
                                   {"troubled_steps", total.troubled_steps},
                                   {"inverted_steps", total.inverted_steps},
                                   {"most_inverted", all.inverted_elements},
                                   {"time", all.time},
                                   {"frames_in_contact", total.frames_in_contact},
                                   {"least_distance", nullptr},
                                   {"smallest_body", size}};
    if (std::isfinite(all.least_distance)) json["least_distance"] = all.least_distance;
    for (const auto& [name, us] : total.times()) json[name] = us;
    json["output_us"] = output_us;
    json["nodes_bounded"] = total.mean(&StepReport::nodes_bounded);
    json["nodes_out_of_range"] = all.nodes_out_of_range;
    json["audited_frames"] = total.audited_frames;
    for (const AuditNumber& number : audit_numbers)
        std::visit([&](auto member) { json[number.name] = total.audit.*member; }, number.member);
    return json;
}

/// A warning about bodies that overlap, or an error if steps refuse the start.
void tell_faults(const std::string& scene, const SceneSpec& spec, World& world, const Output& out) {
    const StartVerdict verdict = judge_start(world, body_labels(spec));
    const std::string line = start_warning(verdict.faults, spec.resolve_start);
    if (!verdict.refusal.empty())
        throw std::invalid_argument(fmt::format("{}: {}", scene, line.empty() ? verdict.refusal : line));
    if (!line.empty()) out.warning(fmt::format("{}: {}", scene, line));
}

}  // namespace

void tell_start(const std::string& scene, const SceneSpec& spec, std::span<const LoadedBody> bodies,
                World& world, const std::vector<StartMove>& moves, const Output& out) {
    for (const StartMove& move : moves)
        out.announcement(fmt::format("{}: {}", scene, moved_text(body_labels(spec)[move.body], move)));
    tell_faults(scene, spec, world, out);
    for (const std::string& line : scene_body_warnings(spec, bodies))
        out.warning(fmt::format("{}: {}", scene, line));
    for (const std::string& line : rest_warnings(spec, world))
        out.warning(fmt::format("{}: {}", scene, line));
    out.end_if_strict();
}

void tell_trouble(const StepTotals& total, const std::string& reason, const Output& out) {
    if (total.otherwise_troubled_steps > 0)
        out.warning(fmt::format(
            "{} of {} steps were kept although something went wrong; {}", total.otherwise_troubled_steps,
            total.steps, reason.empty() ? "see the column `trouble` of --csv" : "the first: " + reason));
    if (total.inverted_steps > 0)
        out.warning(fmt::format(
            "{} of {} steps end with tetrahedra inside out, up to {} at once, the first at {:.6g} "
            "s; a shorter dt, more newton_iterations or the law stable_neo_hookean may help",
            total.inverted_steps, total.steps, total.all.inverted_elements, total.first_inverted));
}

void tell_results(const SceneOutput& paths, bool is_static, int frames, const StepTotals& total, double size,
                  double output_us, const Output& out) {
    out.text(fmt::format("{}: {}, {}; contacts in {}", paths.recording.string(), counted(frames, "frame"),
                         is_static ? fmt::format("up to {:.4g} of the load", total.all.time)
                                   : fmt::format("{:.3f} s simulated", total.all.time),
                         counted(total.frames_in_contact, "frame")));
    for (const std::string& line : other_outputs(paths)) out.text(line);
    if (std::isfinite(total.all.least_distance))
        out.text(
            fmt::format("least distance between surfaces at the end of a step: {:.3g} m, {:.2g} % of the "
                        "smallest body",
                        total.all.least_distance, 100 * total.all.least_distance / size));
    out.text(fmt::format("broad phase per step: {:.1f} us update, {:.1f} us queries, {:.1f} nodes bounded",
                         total.mean(&StepReport::update_us), total.mean(&StepReport::collision_us),
                         total.mean(&StepReport::nodes_bounded)));
    out.text(time_line(total, output_us));
    if (total.audited_frames > 0)
        out.text(fmt::format("audit of {}: {} of {} face pairs within the contact distance missed",
                             counted(total.audited_frames, "frame"), total.audit.near_missed,
                             total.audit.near));
    if (total.audited_frames > 0)
        out.text(fmt::format(
            "audit: {} tests, exact bounds need {}; {:.1f} us per frame, exact bounds take {:.1f}",
            total.audit.tests, total.audit.exact_tests, total.audit.us / total.audited_frames,
            total.audit.exact_us / total.audited_frames));
    if (total.all.nodes_out_of_range > 0)
        out.late_warning(fmt::format("{} nodes were out of their calibrated range and bounded exactly",
                                     total.all.nodes_out_of_range));
    out.result(to_json(total, frames, size, output_us));
}

}  // namespace nbd

// Cuts a step into parts: a rejected part is taken back and halved.
#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "collision/base/stop.hpp"
#include "collision/base/stopwatch.hpp"
#include "sim/world/world.hpp"

namespace nbd {

World::PartStart World::part_start() const {
    PartStart start{.snapshot = snapshot(), .contact_forces = {}};
    for (const Body& body : bodies_) start.contact_forces.push_back(body.contact_forces);
    return start;
}

void World::take_back(const PartStart& start) {
    reset(start.snapshot);
    for (int b = 0; b < body_count(); ++b) at(b).contact_forces = start.contact_forces[b];
}

const char* name(StepTrouble trouble) noexcept {
    switch (trouble) {
        case StepTrouble::none:
            return "";
        case StepTrouble::approach:
            return "approach";
        case StepTrouble::linear_solver:
            return "linear_solver";
        case StepTrouble::newton:
            return "newton";
        case StepTrouble::overlap:
            return "overlap";
        case StepTrouble::contact_passes:
            return "contact_passes";
        case StepTrouble::inverted:
            return "inverted";
    }
    return "";
}

WorldReport World::step(double dt) {
    if (!(dt > 0) || !std::isfinite(dt))
        throw std::invalid_argument(fmt::format("world: dt is {}, but must be > 0", dt));
    const Stopwatch watch;
    detecting_us_ = 0;
    WorldReport report;
    const double begin = time_;
    check_start();
    start_driving(dt);
    for (Body& body : bodies_) body.contact_forces.setZero();
    report.substeps = 1;
    std::optional<PartStart> first, later;  // what parts began from; the first is the start of the step
    for (int done = 0; done < report.substeps;) {
        const double share = 1.0 / report.substeps;
        const StepPart part{.dt = dt * share,
                            .end = begin + dt * ((done + 1) * share),
                            .share = share,
                            .finest = report.substeps >= config_.step.max_substeps};
        const PartStart& start = (first ? later : first).emplace(part_start());
        bool& settled = report.contacts_settled;  // of the parts that are kept
        const bool settled_before = std::exchange(settled, true);
        Rejection rejection;
        try {
            stop_if_asked();
            rejection = try_part(part, report);
        } catch (const StopAsked&) {
            take_back(*first);
            for (Body& body : bodies_)  // nodes driven in this step move in the next one
                if (body.driven.start == begin) body.driven.end = begin;
            throw;
        }
        if (rejection) report.rejection = fmt::format("at {:.6g} s: {}", part.end, rejection.reason);
        const bool is_kept = !rejection || (part.finest && !rejection.fatal);
        settled = settled_before && (settled || !is_kept);
        if (is_kept) {
            if (rejection && report.trouble == StepTrouble::none) {
                report.trouble = rejection.trouble;
                report.trouble_reason = report.rejection;
            }
            ++done;
            continue;
        }
        take_back(start);
        if (part.finest) {
            report.failure = report.rejection;
            break;
        }
        report.substeps *= 2;
        done *= 2;
    }
    if (report.failure.empty() && report.trouble == StepTrouble::none && report.inverted_elements > 0) {
        report.trouble = StepTrouble::inverted;
        report.trouble_reason =
            fmt::format("at {:.6g} s: {} tetrahedra are inside out", time_, report.inverted_elements);
    }
    if (report.trouble == StepTrouble::none && !report.contacts_settled) {
        report.trouble = StepTrouble::contact_passes;
        report.trouble_reason =
            fmt::format("at {:.6g} s: {} passes did not settle which contacts press and slip", time_,
                        config_.contact.iterations);
    }
    report.time = time_;
    report.deepest_penetration = detection_.deepest();
    measure(report);
    report.rest_us = watch.microseconds() - detecting_us_ - report.assemble_us - report.solve_us;
    return report;
}

}  // namespace nbd

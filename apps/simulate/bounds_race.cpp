#include "apps/simulate/bounds_race.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>

namespace nbd {
namespace {

SceneSpec with_bounds(SceneSpec spec, BoundKind kind) {
    for (SceneBody& body : spec.bodies) {
        body.bounds = kind;
        if (!can_miss(kind)) body.margin.reset();
    }
    return spec;
}

}  // namespace

bool can_have(const SceneSpec& spec, const std::vector<LoadedBody>& bodies, BoundKind kind) {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const LoadedBody& body = bodies[b];
        if (is_exact(kind) || kind == BoundKind::automatic) continue;
        if (kind == BoundKind::affine) {
            if (body.body->W.nonZeros() > 0 && body.body->W.coeffs().minCoeff() < 0) return false;
        } else if (!body.tree || !has_bounds(*body.tree, kind) || spec.bodies[b].placement.scale != 1) {
            return false;
        }
    }
    return true;
}

BoundsRace::Run::Run(const SceneSpec& spec, const std::vector<LoadedBody>& bodies, BoundKind kind)
    : bounds(kind), world(build_world(spec, bodies)), audit(spec, bodies) {}

BoundsRace::BoundsRace(const SceneSpec& spec, const std::vector<LoadedBody>& bodies,
                       const std::vector<BoundKind>& kinds)
    : spec_(spec) {
    for (const BoundKind kind : kinds) runs_.emplace_back(with_bounds(spec, kind), bodies, kind);
}

void BoundsRace::run_frame(bool audited) {
    ++frame_;
    std::vector<std::vector<StepRow>> rows(runs_.size());
    for (int step = 0; step < spec_.time.steps_per_frame; ++step)
        for (std::size_t r = 0; r < runs_.size(); ++r) {
            const WorldReport report = runs_[r].world.step(spec_.time.dt);
            if (!report.failure.empty())
                throw std::runtime_error(fmt::format("with bounds \"{}\" the scene fails: {}",
                                                     name(runs_[r].bounds), report.failure));
            rows[r].push_back({report, frame_});
        }
    for (std::size_t r = 0; r < runs_.size(); ++r) {
        if (audited && can_miss(runs_[r].bounds)) rows[r].back().audit = runs_[r].audit.check(runs_[r].world);
        runs_[r].table.add(rows[r]);
    }
}

std::vector<BoundsRace::Row> BoundsRace::rows() const {
    std::vector<Row> rows;
    for (const Run& run : runs_) {
        Row row{.bounds = run.bounds, .totals = run.table.totals()};
        for (int b = 0; b < run.world.body_count(); ++b) {
            const Nodes apart = run.world.state(b).x - runs_.front().world.state(b).x;
            row.farthest = std::max(row.farthest, apart.rowwise().norm().maxCoeff());
        }
        rows.push_back(row);
    }
    return rows;
}

std::string to_text(const std::vector<BoundsRace::Row>& rows, double size) {
    std::string text = fmt::format("{:<15} {:>11} {:>13} {:>9} {:>9} {:>11} {:>16} {:>16} {:>9}", "bounds",
                                   "search, ms", "detection, ms", "step, ms", "search, %", "nodes bounded",
                                   "missed, touching", "missed, near", "apart, %");
    for (const BoundsRace::Row& row : rows) {
        const StepTotals& t = row.totals;
        const auto missed = [&](long count, long of) {
            return t.audited_frames > 0 ? fmt::format("{} of {}", count, of) : std::string("-");
        };
        text += fmt::format("\n{:<15} {:11.3f} {:13.3f} {:9.2f} {:9.2f} {:13.1f} {:>16} {:>16} {:9.2g}",
                            name(row.bounds), 1e-3 * t.search_us(), 1e-3 * t.mean(&StepReport::detect_us),
                            1e-3 * t.step_us(), 100 * t.search_us() / std::max(t.step_us(), 1e-3),
                            t.mean(&StepReport::nodes_bounded),
                            missed(t.audit.intersecting_missed, t.audit.intersecting),
                            missed(t.audit.near_missed, t.audit.near), 100 * row.farthest / size);
    }
    return text;
}

std::string to_csv(const std::vector<BoundsRace::Row>& rows) {
    std::string text = "bounds,steps,frames_in_contact";
    for (const auto& [time, us] : StepTotals().times()) text += "," + time;
    text +=
        ",step_us,nodes_bounded,audited_frames,intersecting_pairs,intersecting_pairs_missed,near_pairs,"
        "near_pairs_missed,farthest\n";
    for (const BoundsRace::Row& row : rows) {
        const StepTotals& t = row.totals;
        text += fmt::format("{},{},{}", name(row.bounds), t.steps, t.frames_in_contact);
        for (const auto& [time, us] : t.times()) text += fmt::format(",{:.6g}", us);
        text += fmt::format(",{:.6g},{:.6g},{},{},{},{},{},{:.6g}\n", t.step_us(),
                            t.mean(&StepReport::nodes_bounded), t.audited_frames, t.audit.intersecting,
                            t.audit.intersecting_missed, t.audit.near, t.audit.near_missed, row.farthest);
    }
    return text;
}

}  // namespace nbd

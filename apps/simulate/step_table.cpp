#include "apps/simulate/step_table.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace nbd {

StepRow step_row(int frame, const WorldReport& report) {
    return {.frame = frame,
            .time = report.time,
            .contacts = report.contacts,
            .substeps = report.substeps,
            .newton_iterations = report.newton_iterations,
            .solver_iterations = report.solver_iterations,
            .inverted_elements = report.inverted_elements,
            .solver_converged = report.solver_converged,
            .face_pairs = report.face_pairs,
            .pairs_measured = report.pairs_measured,
            .nodes_bounded = report.nodes_bounded,
            .nodes_out_of_range = report.nodes_out_of_range,
            .kinetic_energy = report.kinetic_energy,
            .elastic_energy = report.elastic_energy,
            .gravity_energy = report.gravity_energy,
            .deepest_penetration = report.deepest_penetration,
            .update_us = report.update_us,
            .collision_us = report.collision_us,
            .detect_us = report.detect_us,
            .assemble_us = report.assemble_us,
            .solve_us = report.solve_us,
            .rest_us = report.rest_us,
            .trouble = report.trouble,
            .least_distance = report.least_distance};
}

StepTable::StepTable(const std::filesystem::path& path) : file_(path) {
    file_->out()
        << "frame,time,contacts,face_pairs,nodes_bounded,nodes_out_of_range,update_us,collision_us,"
           "detect_us,assemble_us,solve_us,rest_us,substeps,newton_iterations,solver_iterations,"
           "solver_converged,kinetic_energy,elastic_energy,gravity_energy,deepest_penetration,"
           "inverted_elements,trouble,least_distance,intersecting_pairs,intersecting_pairs_missed,near_pairs,"
           "near_pairs_missed,audit_tests,audit_exact_tests,audit_us,audit_exact_us,pairs_measured\n";
}

void StepTable::add(const std::vector<StepRow>& rows) {
    for (const StepRow& row : rows) {
        ++sums_.steps;
        sums_.time = row.time;
        if (row.contacts > 0 && std::exchange(last_frame_in_contact_, row.frame) != row.frame)
            ++sums_.frames_in_contact;
        sums_.deepest_penetration = std::max(sums_.deepest_penetration, row.deepest_penetration);
        sums_.update_us += row.update_us;
        sums_.collision_us += row.collision_us;
        sums_.detect_us += row.detect_us;
        sums_.assemble_us += row.assemble_us;
        sums_.solve_us += row.solve_us;
        sums_.rest_us += row.rest_us;
        sums_.nodes_bounded += static_cast<double>(row.nodes_bounded);
        sums_.nodes_out_of_range += row.nodes_out_of_range;
        sums_.least_distance = std::min(sums_.least_distance, row.least_distance);
        sums_.troubled_steps += row.trouble != StepTrouble::none;
        sums_.otherwise_troubled_steps +=
            row.trouble != StepTrouble::none && row.trouble != StepTrouble::inverted;
        if (row.inverted_elements > 0 && sums_.inverted_steps++ == 0) sums_.first_inverted = row.time;
        sums_.most_inverted = std::max(sums_.most_inverted, row.inverted_elements);
        if (row.audited) {
            ++sums_.audited_frames;
            sums_.audit += row.audit;
        }
        if (file_) write(row);
    }
}

StepTotals StepTable::totals() const {
    StepTotals total = sums_;
    for (double* sum : {&total.update_us, &total.collision_us, &total.detect_us, &total.assemble_us,
                        &total.solve_us, &total.rest_us, &total.nodes_bounded})
        *sum /= std::max(1, total.steps);
    return total;
}

void StepTable::write(const StepRow& row) {
    file_->out() << fmt::format(
        "{},{:.9g},{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{},{},{},{},{:.9g},{:.9g},{:.9g}"
        ",{:.6g},{},{},{}",
        row.frame, row.time, row.contacts, row.face_pairs, row.nodes_bounded, row.nodes_out_of_range,
        row.update_us, row.collision_us, row.detect_us, row.assemble_us, row.solve_us, row.rest_us,
        row.substeps, row.newton_iterations, row.solver_iterations, row.solver_converged ? 1 : 0,
        row.kinetic_energy, row.elastic_energy, row.gravity_energy, row.deepest_penetration,
        row.inverted_elements, name(row.trouble),
        std::isfinite(row.least_distance) ? fmt::format("{:.6g}", row.least_distance) : "");
    if (row.audited)
        file_->out() << fmt::format(",{},{},{},{},{},{},{:.6g},{:.6g}", row.audit.intersecting,
                                    row.audit.intersecting_missed, row.audit.near, row.audit.near_missed,
                                    row.audit.tests, row.audit.exact_tests, row.audit.us, row.audit.exact_us);
    else
        file_->out() << ",,,,,,,,";
    file_->out() << fmt::format(",{}\n", row.pairs_measured);
}

void StepTable::finish() {
    if (file_) file_->commit();
}

}  // namespace nbd

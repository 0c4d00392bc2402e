#include "apps/simulate/step_table.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "meshing/h5/atomic_file.hpp"

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

StepTotals StepTable::totals() const {
    StepTotals total;
    int last_in_contact = 0;
    for (const StepRow& row : rows_) {
        ++total.steps;
        total.time = row.time;
        if (row.contacts > 0 && std::exchange(last_in_contact, row.frame) != row.frame)
            ++total.frames_in_contact;
        total.deepest_penetration = std::max(total.deepest_penetration, row.deepest_penetration);
        total.update_us += row.update_us;
        total.collision_us += row.collision_us;
        total.detect_us += row.detect_us;
        total.assemble_us += row.assemble_us;
        total.solve_us += row.solve_us;
        total.rest_us += row.rest_us;
        total.nodes_bounded += static_cast<double>(row.nodes_bounded);
        total.nodes_out_of_range += row.nodes_out_of_range;
        total.least_distance = std::min(total.least_distance, row.least_distance);
        total.troubled_steps += row.trouble != StepTrouble::none;
        if (!row.audited) continue;
        ++total.audited_frames;
        total.audit += row.audit;
    }
    for (double* sum : {&total.update_us, &total.collision_us, &total.detect_us, &total.assemble_us,
                        &total.solve_us, &total.rest_us, &total.nodes_bounded})
        *sum /= std::max(1, total.steps);
    return total;
}

void StepTable::write(const std::filesystem::path& path) const {
    h5::AtomicFile file(path);
    file.out()
        << "frame,time,contacts,face_pairs,nodes_bounded,nodes_out_of_range,update_us,collision_us,"
           "detect_us,assemble_us,solve_us,rest_us,substeps,"
           "newton_iterations,solver_iterations,"
           "solver_converged,kinetic_energy,elastic_energy,gravity_energy,deepest_penetration,"
           "inverted_elements,trouble,least_distance,intersecting_pairs,intersecting_pairs_missed,near_pairs,"
           "near_pairs_missed,audit_tests,audit_exact_tests,audit_us,audit_exact_us\n";
    for (const StepRow& row : rows_) {
        file.out() << fmt::format(
            "{},{:.9g},{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{},{},{},{},{:.9g},{:.9g},{:.9g}"
            ",{:.6g},{},{},{}",
            row.frame, row.time, row.contacts, row.face_pairs, row.nodes_bounded, row.nodes_out_of_range,
            row.update_us, row.collision_us, row.detect_us, row.assemble_us, row.solve_us, row.rest_us,
            row.substeps, row.newton_iterations, row.solver_iterations, row.solver_converged ? 1 : 0,
            row.kinetic_energy, row.elastic_energy, row.gravity_energy, row.deepest_penetration,
            row.inverted_elements, name(row.trouble),
            std::isfinite(row.least_distance) ? fmt::format("{:.6g}", row.least_distance) : "");
        if (row.audited)
            file.out() << fmt::format(",{},{},{},{},{},{},{:.6g},{:.6g}\n", row.audit.intersecting,
                                      row.audit.intersecting_missed, row.audit.near, row.audit.near_missed,
                                      row.audit.tests, row.audit.exact_tests, row.audit.us,
                                      row.audit.exact_us);
        else
            file.out() << ",,,,,,,,\n";
    }
    file.commit();
}

}  // namespace nbd

#include "apps/step_table.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "meshing/h5/atomic_file.hpp"

namespace nbd {

void StepTable::add_step(const WorldReport& report) {
    ++open_.steps;
    open_.last = report;
    open_.update_us += report.update_us;
    open_.collision_us += report.collision_us;
    open_.nodes_bounded += static_cast<double>(report.nodes_bounded);
    open_.solver_iterations += report.solver_iterations;
    open_.deepest_penetration = std::max(open_.deepest_penetration, report.deepest_penetration);
}

void StepTable::end_frame() {
    rows_.push_back(open_);
    open_ = {};
}

StepTotals StepTable::totals() const {
    StepTotals total;
    int steps = 0;
    for (const Row& row : rows_) {
        steps += row.steps;
        total.time = row.last.time;
        total.frames_in_contact += row.last.contacts > 0;
        total.deepest_penetration = std::max(total.deepest_penetration, row.deepest_penetration);
        total.update_us += row.update_us;
        total.collision_us += row.collision_us;
        total.nodes_bounded += row.nodes_bounded;
        if (row.audit) {
            ++total.audited_frames;
            total.audit += *row.audit;
        }
    }
    for (double* sum : {&total.update_us, &total.collision_us, &total.nodes_bounded})
        *sum /= std::max(1, steps);
    return total;
}

void StepTable::write(const std::filesystem::path& path) const {
    h5::AtomicFile file(path);
    file.out()
        << "time,contacts,face_pairs,nodes_bounded,update_us,collision_us,solver_iterations,kinetic_energy,"
           "elastic_energy,gravity_energy,deepest_penetration,inverted_elements,intersecting_pairs,"
           "intersecting_pairs_missed,near_pairs,near_pairs_missed\n";
    for (const Row& row : rows_) {
        const double steps = row.steps;
        file.out() << fmt::format(
            "{:.9g},{},{},{:.6g},{:.6g},{:.6g},{},{:.9g},{:.9g},{:.9g},{:.6g},{}", row.last.time,
            row.last.contacts, row.last.face_pairs, row.nodes_bounded / steps, row.update_us / steps,
            row.collision_us / steps, row.solver_iterations, row.last.kinetic_energy, row.last.elastic_energy,
            row.last.gravity_energy, row.deepest_penetration, row.last.inverted_elements);
        if (const auto& audit = row.audit)
            file.out() << fmt::format(",{},{},{},{}\n", audit->intersecting, audit->intersecting_missed,
                                      audit->near, audit->near_missed);
        else
            file.out() << ",,,,\n";
    }
    file.commit();
}

}  // namespace nbd

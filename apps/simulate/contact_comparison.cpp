#include "apps/simulate/contact_comparison.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>

namespace nbd {
namespace {

SceneSpec with_all_contacts(SceneSpec spec) {
    spec.contact.contacts_per_node_pair = 0;
    return spec;
}

double energy(const WorldReport& report) {
    return report.kinetic_energy + report.elastic_energy + report.gravity_energy;
}

}  // namespace

ContactComparison::ContactComparison(const SceneSpec& spec, const std::vector<LoadedBody>& bodies)
    : all_(build_world(with_all_contacts(spec), bodies)) {}

void ContactComparison::step(double dt) {
    last_ = all_.step(dt);
    if (!last_.failure.empty())
        throw std::runtime_error(fmt::format("with all contacts, the scene fails: {}", last_.failure));
}

void ContactComparison::compare(const World& world, const WorldReport& report) {
    Row row{.time = report.time,
            .contacts = report.contacts,
            .all_contacts = last_.contacts,
            .penetration = report.deepest_penetration,
            .all_penetration = last_.deepest_penetration,
            .energy = energy(report),
            .all_energy = energy(last_)};
    long nodes = 0;
    for (int b = 0; b < world.body_count(); ++b) {
        const Eigen::VectorXd apart = (world.state(b).x - all_.state(b).x).rowwise().norm();
        row.farthest = std::max(row.farthest, apart.maxCoeff());
        row.mean += apart.sum();
        nodes += apart.size();
        const Eigen::RowVector3d force = all_.contact_forces(b).colwise().sum(),
                                 other = world.contact_forces(b).colwise().sum();
        if (force.norm() >= row.force) {
            row.force = force.norm();
            row.force_difference = (other - force).norm();
        }
    }
    row.mean /= nodes;
    rows_.push_back(row);
}

std::string ContactComparison::table(double size) const {
    std::string text = fmt::format("{:>9} {:>16} {:>12} {:>12} {:>21} {:>18} {:>23}", "time, s",
                                   "contacts (all)", "farthest, %", "mean, %", "penetration (all), mm",
                                   "force, N (differs)", "energy, J (all)");
    const std::size_t every = (rows_.size() + 9) / 10;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        if ((rows_.size() - 1 - i) % every != 0) continue;
        const Row& row = rows_[i];
        text += fmt::format(
            "\n{:9.4g} {:7} ({:6}) {:12.2g} {:12.2g} {:10.3g} ({:8.3g}) {:9.3g} ({:5.1f} %) "
            "{:11.5g} ({:9.5g})",
            row.time, row.contacts, row.all_contacts, 100 * row.farthest / size, 100 * row.mean / size,
            1e3 * row.penetration, 1e3 * row.all_penetration, row.force,
            row.force > 0 ? 100 * row.force_difference / row.force : 0, row.energy, row.all_energy);
    }
    return text;
}

}  // namespace nbd

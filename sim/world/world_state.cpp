#include "sim/world/world_state.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "sim/fem/momentum.hpp"

namespace nbd {

bool SteppedBody::could_take(const std::vector<Nodes>& places) const {
    if (places.size() != grips.size()) return false;
    for (std::size_t g = 0; g < grips.size(); ++g) {
        const Eigen::Index rows = places[g].rows();
        const bool fits = rows == 0 || (takes_later(g) && rows == std::ssize(grips[g].nodes));
        if (!fits || !places[g].allFinite()) return false;
    }
    return true;
}

Nodes WorldState::part_of(int body, const Eigen::VectorXd& stacked) const {
    return Eigen::Map<const Nodes>(stacked.data() + first_unknown[body], at(body).state.v.rows(), 3);
}

std::vector<TimeStep> WorldState::steps() const {
    std::vector<TimeStep> steps;
    for (const SteppedBody& body : bodies) steps.push_back(step_of(body));
    return steps;
}

std::vector<Nodes> WorldState::nodes_now() const {
    std::vector<Nodes> nodes;
    for (const SteppedBody& body : bodies) nodes.push_back(body.state.x);
    return nodes;
}

std::vector<Nodes> WorldState::nodes_after(double dt, const Eigen::VectorXd& v) const {
    std::vector<Nodes> nodes;
    for (int b = 0; b < body_count(); ++b) nodes.push_back(at(b).start.x + dt * part_of(b, v));
    return nodes;
}

std::vector<Eigen::Vector3d> WorldState::centres_of(std::span<const Nodes> x) const {
    std::vector<Eigen::Vector3d> centres;
    for (std::size_t b = 0; b < bodies.size(); ++b)
        centres.push_back(centre_of_mass(*bodies[b].elastic, x[b]));
    return centres;
}

double WorldState::thickness() const noexcept {
    return config.contact.thickness > 0 ? config.contact.thickness : 0.001 * smallest_diagonal();
}

double WorldState::smallest_diagonal() const noexcept {
    double smallest = std::numeric_limits<double>::infinity();
    for (const SteppedBody& body : bodies) smallest = std::min(smallest, body.shape->rest_diagonal);
    return smallest;
}

double WorldState::load_share(double time) const noexcept {
    return config.statics ? std::clamp(time, 0.0, 1.0) : 1;
}

Eigen::Vector3d WorldState::gravity_at(double time) const {
    return config.gravity_keys.at(time, load_share(time) * config.gravity);
}

bool WorldState::is_held(const SteppedBody& body) const {
    return !body.driven.nodes.empty() || std::ranges::any_of(body.grips, [&](const Grip& grip) {
        return grip.holds(time) && !grip.nodes.empty();
    });
}

bool WorldState::is_held_throughout(const SteppedBody& body) const {
    if (!is_held(body)) return false;
    std::set<int> held(body.driven.nodes.begin(), body.driven.nodes.end());
    for (const Grip& grip : body.grips)
        if (grip.holds(time)) held.insert(grip.nodes.begin(), grip.nodes.end());
    return std::ssize(held) == body.state.x.rows();
}

bool WorldState::can_turn(const SteppedBody& body) const {
    std::vector<int> held = body.driven.nodes;
    for (const Grip& grip : body.grips)
        if (grip.holds(time)) held.insert(held.end(), grip.nodes.begin(), grip.nodes.end());
    if (held.size() < 2) return true;
    const Nodes& X = body.elastic->rest().X;
    const Nodes ways = X(held, Eigen::all).rowwise() - X.row(held.front());
    Eigen::Index farthest = 0;
    const double longest = ways.rowwise().squaredNorm().maxCoeff(&farthest);
    const Eigen::RowVector3d along = ways.row(farthest) / std::sqrt(longest);
    constexpr double rounding = 1e-6;
    for (Eigen::Index k = 0; longest > 0 && k < ways.rows(); ++k)
        if (ways.row(k).cross(along).squaredNorm() > rounding * rounding * longest) return false;
    return true;
}

PrescribedNodes WorldState::prescribed(const SteppedBody& body, double dt) const {
    PrescribedNodes result;
    std::vector<Eigen::Vector3d> v;
    const auto add = [&](int node, const Eigen::Vector3d& target) {
        const Eigen::Vector3d x = body.start.x.row(node);
        result.nodes.push_back(node);
        v.push_back((target - x) / dt);
    };
    for (std::size_t g = 0; g < body.grips.size(); ++g) {
        const Grip& grip = body.grips[g];
        if (!grip.holds(time)) continue;
        const Placing placing = grip.motion.at(time + dt);
        for (std::size_t k = 0; k < grip.nodes.size(); ++k)
            add(grip.nodes[k], placing(body.grip_start[g].row(k)));
    }
    const std::vector<int> gripped = result.nodes;  // after a restore, some driven nodes may be gripped again
    for (std::size_t k = 0; k < body.driven.nodes.size(); ++k)
        if (std::ranges::find(gripped, body.driven.nodes[k]) == gripped.end())
            add(body.driven.nodes[k], body.driven.at(k, time + dt));
    result.v.resize(v.size(), 3);
    for (std::size_t i = 0; i < v.size(); ++i) result.v.row(i) = v[i];
    return result;
}

bool WorldState::is_joined(int body) const {
    for (std::size_t j = 0; j < joints.size(); ++j)
        if (!broken[j] && (joints[j].joint().a == body || joints[j].joint().b == body)) return true;
    return false;
}

void WorldState::forget_steps(const Joint& joint) {
    for (const int body : {joint.a, joint.b})
        if (body >= 0) at(body).before.reset();
}

int WorldState::tendon_of(int joint) const {
    for (std::size_t t = 0; t < tendons.size(); ++t)
        if (std::ranges::find(tendons[t].parts, joint) != tendons[t].parts.end()) return static_cast<int>(t);
    return -1;
}

}  // namespace nbd

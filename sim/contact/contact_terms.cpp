#include "sim/contact/contact_terms.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

namespace nbd {

void ContactTerms::clear() {
    terms_.clear();
    bodies_.clear();
    begin_.assign(1, 0);
}

void ContactTerms::add(const Contact& contact, std::span<const ContactShape* const> shapes,
                       std::span<const int> first_unknown) {
    add_point(contact.a, 1, shapes, first_unknown);
    add_point(contact.b, -1, shapes, first_unknown);
    bodies_.push_back({contact.a.body, contact.b.body});
    begin_.push_back(terms_.size());
}

void ContactTerms::add(const Bond& bond, std::span<const int> first_unknown) {
    const std::ptrdiff_t begin = begin_.back();
    for (const auto& [point, sign] : {std::pair(&bond.a, 1.0), std::pair(&bond.b, -1.0)})
        for (std::size_t k = 0; k < point->nodes.size(); ++k)
            add_term(point->body, point->nodes[k], sign * point->weights[k], begin, first_unknown);
    bodies_.push_back({bond.a.body, bond.b.body});
    begin_.push_back(terms_.size());
}

void ContactTerms::add_point(const SurfacePoint& point, double sign,
                             std::span<const ContactShape* const> shapes,
                             std::span<const int> first_unknown) {
    const std::ptrdiff_t begin = begin_.back();
    for (int k = 0; k < point.count; ++k)
        for (Embedding::InnerIterator entry(shapes[point.body]->W, point.vertices[k]); entry; ++entry)
            add_term(point.body, entry.col(), sign * point.weights[k] * entry.value(), begin, first_unknown);
}

/// Adds a weight to those of the contact whose terms start at `begin`.
void ContactTerms::add_term(int body, int node, double weight, std::ptrdiff_t begin,
                            std::span<const int> first_unknown) {
    if (weight == 0) return;
    const auto known = std::find_if(terms_.begin() + begin, terms_.end(),
                                    [&](const CouplingTerm& t) { return t.body == body && t.node == node; });
    if (known != terms_.end())
        known->weight += weight;
    else
        terms_.push_back({body, node, first_unknown[body] + 3 * node, weight, false});
}

void ContactTerms::hold(std::span<const StepSystem> systems) {
    for (CouplingTerm& t : terms_) t.held = systems[t.body].is_prescribed(t.node);
}

Eigen::Vector3d ContactTerms::velocity(std::size_t contact, const Eigen::VectorXd& v) const {
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    for (const CouplingTerm& t : of(contact)) u += t.weight * v.segment<3>(t.unknown);
    return u;
}

void ContactTerms::add_impulse(std::size_t contact, const Eigen::Vector3d& p, bool held,
                               Eigen::VectorXd& out) const {
    for (const CouplingTerm& t : of(contact))
        if (held || !t.held) out.segment<3>(t.unknown) += t.weight * p;
}

Eigen::Vector3d ContactTerms::acts_at(std::size_t contact, const BodyPositions& at) const {
    Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();
    const auto [body_a, body_b] = bodies_[contact];
    for (const CouplingTerm& t : of(contact)) {
        const Eigen::Vector3d x = at.x[t.body].row(t.node);
        (t.body == body_a ? a : b) += (t.body == body_a ? t.weight : -t.weight) * x;
    }
    if (body_b < 0) return a;
    return body_a < 0 ? b : Eigen::Vector3d((a + b) / 2);
}

void ContactTerms::add_momentum(std::size_t contact, const Eigen::Vector3d& p, const BodyPositions& at,
                                std::vector<Momentum>& momenta) const {
    const auto [body_a, body_b] = bodies_[contact];
    if (body_a == body_b) return;
    const Eigen::Vector3d point = acts_at(contact, at);
    const auto act = [&](int body, const Eigen::Vector3d& impulse) {
        if (body < 0) return;
        Momentum& momentum = momenta[body];
        momentum.linear += impulse;
        momentum.angular += (point - at.centres[body]).cross(impulse);
    };
    act(body_a, p);
    act(body_b, -p);
}

}  // namespace nbd

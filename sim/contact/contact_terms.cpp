#include "sim/contact/contact_terms.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace nbd {

void ContactTerms::clear() {
    terms_.clear();
    begin_.assign(1, 0);
}

void ContactTerms::add(const Contact& contact, std::span<const ContactShape* const> shapes,
                       std::span<const int> first_unknown) {
    add_point(contact.a, 1, shapes, first_unknown);
    add_point(contact.b, -1, shapes, first_unknown);
    begin_.push_back(terms_.size());
}

void ContactTerms::add_point(const SurfacePoint& point, double sign,
                             std::span<const ContactShape* const> shapes,
                             std::span<const int> first_unknown) {
    const std::ptrdiff_t begin = begin_.back();
    for (int k = 0; k < point.count; ++k) {
        const std::size_t body = point.body;
        for (Embedding::InnerIterator entry(shapes[body]->W, point.vertices[k]); entry; ++entry) {
            const double weight = sign * point.weights[k] * entry.value();
            const int node = entry.col();
            if (weight == 0) continue;
            const auto known = std::find_if(terms_.begin() + begin, terms_.end(), [&](const CouplingTerm& t) {
                return t.body == point.body && t.node == node;
            });
            if (known != terms_.end())
                known->weight += weight;
            else
                terms_.push_back({point.body, node, first_unknown[body] + 3 * node, weight, false});
        }
    }
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

Eigen::Vector3d ContactTerms::acts_at(const Contact& contact, std::size_t index,
                                      const BodyPositions& at) const {
    Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();
    for (const CouplingTerm& t : of(index)) {
        const Eigen::Vector3d x = at.x[t.body].row(t.node);
        (t.body == contact.a.body ? a : b) += (t.body == contact.a.body ? t.weight : -t.weight) * x;
    }
    return contact.b.body < 0 ? a : (a + b) / 2;
}

void ContactTerms::add_momentum(const Contact& contact, std::size_t index, const Eigen::Vector3d& p,
                                const BodyPositions& at, std::vector<Momentum>& momenta) const {
    if (contact.a.body == contact.b.body) return;
    const Eigen::Vector3d point = acts_at(contact, index, at);
    const auto act = [&](int body, const Eigen::Vector3d& impulse) {
        Momentum& momentum = momenta[body];
        momentum.linear += impulse;
        momentum.angular += (point - at.centres[body]).cross(impulse);
    };
    act(contact.a.body, p);
    if (contact.b.body >= 0) act(contact.b.body, -p);
}

}  // namespace nbd

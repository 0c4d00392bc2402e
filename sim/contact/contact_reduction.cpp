#include "sim/contact/contact_reduction.hpp"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

namespace nbd {
namespace {

/// The node that carries most of a point; the first of several.
int heaviest_node(const SurfacePoint& point, const ContactSurface& surface) {
    int node = -1;
    double most = -std::numeric_limits<double>::infinity();
    for (int k = 0; k < point.count; ++k)
        for (Embedding::InnerIterator entry(surface.W(), point.vertices[k]); entry; ++entry) {
            const double weight = point.weights[k] * entry.value();
            if (weight > most) {
                most = weight;
                node = entry.col();
            }
        }
    return node;
}

Eigen::Vector3d place_of(const SurfacePoint& point, const ContactSurface& surface) {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (int k = 0; k < point.count; ++k) place += point.weights[k] * surface.x(point.vertices[k]);
    return place;
}

}  // namespace

void ContactReduction::reduce(std::vector<Contact>& contacts, std::size_t first, int body_a,
                              const ContactSurface& a, const ContactSurface& b, double thickness,
                              int contacts_per_node_pair) {
    members_.clear();
    for (std::size_t c = first; c < contacts.size(); ++c) {
        const Contact& contact = contacts[c];
        const bool in_order = contact.a.body == body_a;
        const SurfacePoint &on_a = in_order ? contact.a : contact.b, &on_b = in_order ? contact.b : contact.a;
        Member member{heaviest_node(on_a, a), heaviest_node(on_b, b), static_cast<int>(c), place_of(on_a, a)};
        if (on_a.body == on_b.body && member.node_a > member.node_b) std::swap(member.node_a, member.node_b);
        members_.push_back(member);
    }
    std::ranges::sort(members_, {},
                      [](const Member& m) { return std::tuple(m.node_a, m.node_b, m.contact); });
    keeps_.assign(contacts.size(), 0);
    std::fill_n(keeps_.begin(), first, 1);
    for (std::size_t begin = 0, end = 0; begin < members_.size(); begin = end) {
        while (end < members_.size() && members_[end].node_a == members_[begin].node_a &&
               members_[end].node_b == members_[begin].node_b)
            ++end;
        reduce_group(contacts, begin, end, thickness, contacts_per_node_pair);
    }
    std::size_t kept = first;
    for (std::size_t c = first; c < contacts.size(); ++c)
        if (keeps_[c]) contacts[kept++] = contacts[c];
    contacts.resize(kept);
}

/// The group: members_[begin, end).
void ContactReduction::reduce_group(std::vector<Contact>& contacts, std::size_t begin, std::size_t end,
                                    double thickness, int contacts_per_node_pair) {
    const auto contact = [&](std::size_t m) -> Contact& { return contacts[members_[m].contact]; };
    const std::size_t most = std::min(static_cast<std::size_t>(contacts_per_node_pair), end - begin);
    kept_.clear();
    distances_.assign(end - begin, std::numeric_limits<double>::infinity());
    std::size_t next = begin;  // the deepest, then the farthest from those kept
    for (std::size_t m = begin; m < end; ++m)
        if (contact(m).gap < contact(next).gap) next = m;
    while (kept_.size() < most) {
        kept_.push_back(next);
        keeps_[members_[next].contact] = 1;
        for (std::size_t m = begin; m < end; ++m)
            distances_[m - begin] = std::min(
                distances_[m - begin], (members_[m].place - members_[kept_.back()].place).squaredNorm());
        // Contacts at the place of one that is kept add nothing, and would be taken again.
        next = begin;
        for (std::size_t m = begin; m < end; ++m)
            if (distances_[m - begin] > distances_[next - begin]) next = m;
        if (!(distances_[next - begin] > 0)) break;
    }
    if (kept_.size() == end - begin) return;
    pressure_.assign(kept_.size(), 0);
    areas_.assign(kept_.size(), 0);
    for (std::size_t m = begin; m < end; ++m) {
        std::size_t nearest = 0;
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < kept_.size(); ++k) {
            const double squared =
                m == kept_[k] ? -1 : (members_[m].place - members_[kept_[k]].place).squaredNorm();
            if (squared < least) least = squared, nearest = k;
        }
        areas_[nearest] += contact(m).area;
        pressure_[nearest] += contact(m).area * std::max(thickness - contact(m).gap, 0.0);
    }
    for (std::size_t k = 0; k < kept_.size(); ++k) {
        Contact& kept = contact(kept_[k]);
        kept.area = areas_[k];
        if (pressure_[k] > 0) kept.gap = thickness - pressure_[k] / areas_[k];
    }
}

}  // namespace nbd

// Coulomb's coefficient where surfaces touch.
#include <algorithm>

#include "sim/barrier/barrier.hpp"

namespace nbd {

/// Of a point of a body's surface: what the vertices that carry it have of their own.
Barrier::OwnFriction Barrier::own_friction(const SurfacePoint& point) const {
    OwnFriction own;
    if (point.body < 0 || bodies_[point.body].friction.empty()) return own;
    for (int k = 0; k < point.count; ++k) {
        const std::size_t i = k;
        const double at = bodies_[point.body].friction[point.vertices[i]];
        if (!(at >= 0)) continue;
        own.sum += point.weights[i] * at;
        own.share += point.weights[i];
    }
    return own;
}

/// That of the rule for the pair; else of the surfaces there, of two the smaller; else the usual one. Where a
/// vertex has none of its own, the other surface's counts: so it does not jump where a part with its own
/// ends.
double Barrier::friction(const Contact& contact, double usual) const {
    const OwnFriction a = own_friction(contact.a), b = own_friction(contact.b);
    const double of_surfaces = std::min(a.beside(b.beside(usual)), b.beside(a.beside(usual)));
    const int other = contact.b.body < 0 ? party_of_obstacle(contact.obstacle) : contact.b.body;
    return rules_.friction(contact.a.body, other, of_surfaces);
}

}  // namespace nbd

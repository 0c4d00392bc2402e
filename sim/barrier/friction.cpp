// Coulomb's coefficient where surfaces touch.
#include <algorithm>

#include "sim/barrier/barrier.hpp"

namespace nbd {

/// Of a point of a body's surface: the mean over the vertices that carry it, of which some have the usual
/// coefficient; none where all of them have it.
std::optional<double> Barrier::own_friction(const SurfacePoint& point, double usual) const {
    if (point.body < 0) return std::nullopt;
    const std::vector<double>& own = bodies_[point.body].friction;
    if (own.empty()) return std::nullopt;
    double sum = 0;
    bool is_own = false;
    for (int k = 0; k < point.count; ++k) {
        const std::size_t i = k;
        const double at = own[point.vertices[i]];
        is_own = is_own || (at >= 0 && point.weights[i] > 0);
        sum += point.weights[i] * (at >= 0 ? at : usual);
    }
    return is_own ? std::optional(std::max(sum, 0.0)) : std::nullopt;
}

/// That of the rule for the pair; else of the surfaces there, of two the smaller; else the usual one.
double Barrier::friction(const Contact& contact, double usual) const {
    const std::optional<double> a = own_friction(contact.a, usual), b = own_friction(contact.b, usual);
    const double of_surfaces = a && b ? std::min(*a, *b) : a.value_or(b.value_or(usual));
    const int other = contact.b.body < 0 ? party_of_obstacle(contact.obstacle) : contact.b.body;
    return rules_.friction(contact.a.body, other, of_surfaces);
}

}  // namespace nbd

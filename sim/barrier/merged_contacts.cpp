#include "sim/barrier/merged_contacts.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace nbd {
namespace {

/// The vertices that carry a point of a contact, at most two, ascending: {number, body, first, second}.
using PointKey = std::array<int, 4>;
/// Of both points, the smaller first: equal for contacts of the same points.
using ContactKey = std::array<int, 8>;

/// Empty for a point inside a face.
std::optional<PointKey> key_of(const SurfacePoint& point) {
    PointKey key{0, point.body, -1, -1};
    for (int k = 0; k < point.count; ++k) {
        if (point.weights[k] == 0) continue;
        if (key[0] == 2) return std::nullopt;
        key[2 + key[0]++] = point.vertices[k];
    }
    if (key[0] == 2 && key[2] > key[3]) std::swap(key[2], key[3]);
    return key;
}

/// Empty for contacts that only one pair of features has: inside a face or between two edges, or with an
/// obstacle.
std::optional<ContactKey> key_of(const Contact& contact) {
    if (contact.b.body < 0) return std::nullopt;
    const std::optional<PointKey> a = key_of(contact.a), b = key_of(contact.b);
    if (!a || !b || (*a)[0] + (*b)[0] > 3) return std::nullopt;
    const auto& [least, most] = std::minmax(*a, *b);
    ContactKey key;
    std::ranges::copy(least, key.begin());
    std::ranges::copy(most, key.begin() + least.size());
    return key;
}

}  // namespace

std::vector<Contact> merged(std::vector<Contact> contacts) {
    std::vector<std::pair<ContactKey, std::size_t>> order;
    std::vector<Contact> result;
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        if (const std::optional<ContactKey> key = key_of(contacts[c]))
            order.emplace_back(*key, c);
        else
            result.push_back(contacts[c]);
    }
    std::ranges::sort(order);
    for (std::size_t i = 0; i < order.size(); ++i) {
        const Contact& contact = contacts[order[i].second];
        if (i > 0 && order[i].first == order[i - 1].first &&
            result.back().barrier.reach == contact.barrier.reach)
            result.back().barrier.stiffness += contact.barrier.stiffness;
        else
            result.push_back(contact);
    }
    return result;
}

}  // namespace nbd

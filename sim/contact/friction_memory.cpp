#include "sim/contact/friction_memory.hpp"

#include <algorithm>

namespace nbd {
namespace {

/// What a contact is known by, and whether its first body is that of point a.
struct Name {
    std::array<int, 6> key;
    bool is_of_a = true;
};

/// The vertices that carry a point, at most three, ascending; -1 for none.
struct Carriers {
    explicit Carriers(const SurfacePoint& point) {
        for (std::size_t k = 0; k < static_cast<std::size_t>(point.count); ++k) {
            if (point.weights[k] == 0) continue;
            std::size_t place = count++;
            for (; place > 0 && vertices[place - 1] > point.vertices[k]; --place)
                vertices[place] = vertices[place - 1];
            vertices[place] = point.vertices[k];
        }
    }
    std::size_t count = 0;
    std::array<int, 3> vertices{-1, -1, -1};
};

/// The names of a contact: two where a vertex is nearest to a vertex.
std::vector<Name> names_of(const Contact& contact) {
    const Carriers a(contact.a), b(contact.b);
    const int other = contact.b.body < 0 ? -1 - std::max(contact.obstacle, 0) : contact.b.body;
    std::vector<Name> names;
    if (a.count == 1) names.push_back({{contact.a.body, a.vertices[0], -1, other, -1, -1}, true});
    if (b.count == 1) names.push_back({{contact.b.body, b.vertices[0], -1, contact.a.body, -1, -1}, false});
    if (!names.empty()) return names;
    const std::array<int, 3> of_a{contact.a.body, a.vertices[0], a.vertices[1]},
        of_b{other, b.count > 0 ? b.vertices[0] : a.vertices[2], b.vertices[1]};
    const bool is_a_first = contact.b.body < 0 || of_a < of_b;
    const auto &first = is_a_first ? of_a : of_b, &second = is_a_first ? of_b : of_a;
    return {{{first[0], first[1], first[2], second[0], second[1], second[2]}, is_a_first}};
}

}  // namespace

void FrictionMemory::recall(Contact& contact, double slip_length) const {
    contact.slip_length = slip_length;
    contact.stretch.setZero();
    for (const Name& name : names_of(contact)) {
        const auto known = ways_.find(name.key);
        if (known == ways_.end()) continue;
        const Eigen::Vector3d way = name.is_of_a ? known->second : Eigen::Vector3d(-known->second);
        contact.stretch = contact.along(way);
        return;
    }
}

void FrictionMemory::remember(std::span<const RubbedContact> contacts) {
    std::map<std::array<int, 6>, double> pressed;  // the hardest of the contacts of one name counts
    ways_.clear();
    for (const auto& [contact, slid, impulse] : contacts) {
        if (!(impulse > 0) || !(contact.friction > 0)) continue;
        Eigen::Vector3d way = contact.stretch + slid;
        if (const double length = way.norm(); length > contact.slip_length)
            way *= contact.slip_length / length;
        for (const Name& name : names_of(contact)) {
            double& most = pressed[name.key];
            if (impulse <= most) continue;
            most = impulse;
            ways_[name.key] = name.is_of_a ? way : Eigen::Vector3d(-way);
        }
    }
}

FrictionStretches FrictionMemory::stretches() const {
    FrictionStretches result;
    for (const auto& [contact, way] : ways_) {
        result.contacts.push_back(contact);
        result.ways.push_back(way);
    }
    return result;
}

void FrictionMemory::restore(const FrictionStretches& stretches) {
    ways_.clear();
    for (std::size_t i = 0; i < stretches.contacts.size(); ++i)
        ways_.emplace(stretches.contacts[i], stretches.ways[i]);
}

}  // namespace nbd

#pragma once

#include <limits>
#include <vector>

#include "sim/contact/body_contact.hpp"

namespace nbd::test {

/// How two surfaces are searched for contacts in a step of 5 ms.
struct ContactSearch {
    ContactReach reach;
    ContactDetail detail = ContactDetail::all;
    double moved = std::numeric_limits<double>::infinity();    // metres since the last search
    Eigen::RowVector3d velocity = Eigen::RowVector3d::Zero();  // of all nodes of b, m/s
    Eigen::Vector3d origin{0, 0, 0.15};                        // of single precision
};

/// The contacts of surfaces near the origin, from all pairs of their patches. measured: out, the number of
/// face pairs that were measured; may be null.
inline std::vector<Contact> find_contacts(BodyContactFinder& finder, const ContactSurface& a,
                                          const ContactSurface& b, const ContactSearch& search,
                                          long* measured = nullptr) {
    const Nodes v_a = Nodes::Zero(a.W().cols(), 3),
                v_b = Nodes::Zero(b.W().cols(), 3).rowwise() + search.velocity;
    std::vector<PatchPair> all;
    for (int i = 0; i < a.patches().count(); ++i)
        for (int j = 0; j < b.patches().count(); ++j)
            if (!a.patches().faces[i].empty() && !b.patches().faces[j].empty()) all.push_back({i, j});
    PosedPatches posed_a, posed_b;
    posed_a.begin(a, search.origin, v_a, 0.005);
    posed_b.begin(b, search.origin, v_b, 0.005);
    std::vector<Contact> contacts;
    const long pairs =
        finder.find(posed_a, posed_b, all, search.reach, search.detail, search.moved, contacts);
    if (measured) *measured = pairs;
    return contacts;
}

}  // namespace nbd::test

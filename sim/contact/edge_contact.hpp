#pragma once

#include <span>
#include <vector>

#include "collision/geometry/geometry.hpp"
#include "sim/contact/contact.hpp"
#include "sim/contact/contact_surface.hpp"

namespace nbd {

/// A body number and its surface.
struct BodySurface {
    int body = 0;
    const ContactSurface& surface;
};

/// Appends contacts of edge pairs whose closest points are interior to both edges. Either they are apart,
/// each edge on the outer side of the other, or they overlap: each is behind the other, and one crosses a
/// face of the other body. Each contact is appended once, in an order that depends only on the pairs;
/// stiffness and friction stay zero.
/// pairs: face pairs, sorted, without repeats, within reach.most() of each other; pairs farther apart do no
/// harm.
void find_edge_contacts(const BodySurface& a, const BodySurface& b, std::span<const FacePair> pairs,
                        const ContactReach& reach, std::vector<Contact>& contacts);

}  // namespace nbd

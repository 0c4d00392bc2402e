#pragma once

#include <span>
#include <vector>

#include "collision/geometry/geometry.hpp"
#include "sim/contact/contact.hpp"
#include "sim/contact/contact_surface.hpp"

namespace nbd {

/// A body's number and its surface.
struct BodySurface {
    int body = 0;
    const ContactSurface& surface;
};

/// Contacts of pairs of edges that come closest within both of them: apart, each edge on the outer side of
/// the other, or overlapping, behind it and through a face of the other body. Appends each once, in an order
/// that depends on the pairs alone; stiffness and friction stay zero. pairs: of faces, sorted, without
/// repeats; all within reach.most() of each other, others do no harm.
void find_edge_contacts(const BodySurface& a, const BodySurface& b, std::span<const FacePair> pairs,
                        const ContactReach& reach, std::vector<Contact>& contacts);

}  // namespace nbd

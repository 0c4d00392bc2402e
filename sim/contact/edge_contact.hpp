#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sim/contact/contact.hpp"
#include "sim/patches/posed_patches.hpp"

namespace nbd {

/// A body number and the posed patches of its surface.
struct BodyPatches {
    int body = 0;
    PosedPatches& patches;
};

/// An edge of a body's surface.
struct EdgeOfBody {
    int body;
    const ContactSurface& surface;
    int edge;
};

/// The contact of two edges, if their closest points are interior to both and they are in reach, as
/// find_edge_contacts() says. motion: how far they may approach each other in the step, metres.
std::optional<Contact> edge_contact(const EdgeOfBody& a, const EdgeOfBody& b,
                                    const ContactReach& surface_reach, double motion);

/// Appends contacts of edge pairs whose closest points are interior to both edges. Either they are apart,
/// each edge on the outer side of the other, or they overlap: each is behind the other, and one crosses a
/// face of the other body. Each contact is appended once, by ascending edges; stiffness and friction stay
/// zero.
/// pairs: patches that were required, without repeats: all that own edges within reach of each other; more do
/// no harm. detail: with `enough`, pairs of edges that are both short beside the contact distance are left to
/// their vertices. Returns how many pairs were examined in double precision.
long find_edge_contacts(const BodyPatches& a, const BodyPatches& b, std::span<const PatchPair> pairs,
                        const ContactReach& reach, ContactDetail detail, std::vector<Contact>& contacts);

}  // namespace nbd

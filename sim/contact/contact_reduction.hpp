#pragma once

#include <cstddef>
#include <vector>

#include "sim/contact/contact.hpp"
#include "sim/patches/contact_surface.hpp"

namespace nbd {

/// Reduces contacts on surfaces that are much finer than the nodes that carry them to as many as the nodes
/// can feel. Contacts whose points are carried mostly by the same two nodes, one of each body, make a group.
/// A group keeps at most `contacts_per_node_pair` contacts: the deepest, then those farthest from the ones
/// kept. Each of the others adds its area to the nearest kept one, whose gap becomes the one at which the sum
/// of both presses as hard as they would at the start of the step. So forces, momentum and torque hardly
/// change.
class ContactReduction {
 public:
    /// Replaces the contacts from `first` on, all of them between body_a and another body, or itself. a, b:
    /// the surfaces of the two bodies, in the pose of the contacts. thickness: metres.
    /// contacts_per_node_pair: >= 1. The order of those kept stays.
    void reduce(std::vector<Contact>& contacts, std::size_t first, int body_a, const ContactSurface& a,
                const ContactSurface& b, double thickness, int contacts_per_node_pair);

 private:
    /// A contact, the nodes that carry most of it, and where it is.
    struct Member {
        int node_a, node_b, contact;
        Eigen::Vector3d place;
    };
    void reduce_group(std::vector<Contact>& contacts, std::size_t begin, std::size_t end, double thickness,
                      int contacts_per_node_pair);

    std::vector<Member> members_;  // group after group
    std::vector<char> keeps_;      // [contacts]
    std::vector<std::size_t> kept_;
    std::vector<double> distances_, pressure_, areas_;
};

}  // namespace nbd

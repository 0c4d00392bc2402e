#pragma once

#include "sim/contact/contact.hpp"

namespace nbd {

/// A contact that keeps its points apart. `gap` of the contact is their distance.
struct BarrierContact {
    Contact contact;
    double slope = 0, curvature = 0;  // of the potential by the distance: N, N/m
    // The potential also changes as an edge turns, see EdgeMollifier: then point `a` is the difference of its
    // ends, b is empty, and the forces of the contact sum to zero.
    bool turns = false;
};

}  // namespace nbd

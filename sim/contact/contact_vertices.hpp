#pragma once

#include "sim/contact/contact.hpp"
#include "sim/patches/contact_surface.hpp"

namespace nbd {

/// The vertices that make contact, and the area of each. A view of the surface's shape.
struct ContactVertices {
    const IndexLists& of_patch;
    const Eigen::VectorXd& areas;  // [n] m2
};

inline ContactVertices contact_vertices(const ContactSurface& surface, ContactDetail detail) noexcept {
    if (detail == ContactDetail::all) return {surface.patches().vertices, surface.rest_areas()};
    return {surface.shape()->patch_samples, surface.shape()->sample_areas};
}

}  // namespace nbd

#pragma once

#include <span>
#include <vector>

#include "collision/geometry/geometry.hpp"
#include "sim/contact/contact.hpp"
#include "sim/contact/contact_sides.hpp"
#include "sim/contact/contact_surface.hpp"

namespace nbd {

/// Finds the contacts of two bodies among nearby face pairs: each vertex with the nearest face of the other
/// body, and each pair of edges that cross at a distance. For each vertex in contact it remembers the side by
/// which the vertex came, so that a vertex behind the other's surface is pushed back out on that side, and
/// its depth. A vertex that seems deeper than the bodies' motion since then allows lies behind a fold of a
/// crushed surface and is not a contact.
class BodyContactFinder {
 public:
    /// body_a, body_b: body numbers to store in the contacts.
    BodyContactFinder(int body_a, int body_b) : body_a_(body_a), body_b_(body_b) {}

    /// Appends every contact once, in an order that depends only on the pairs; stiffness and friction stay
    /// zero.
    /// pairs: sorted, without repeats, with every pair within reach.most(); pairs farther apart do no harm.
    /// moved: maximum approach of the bodies since the last call, metres.
    void find(const ContactSurface& a, const ContactSurface& b, std::span<const FacePair> pairs,
              const ContactReach& reach, double moved, std::vector<Contact>& contacts);

    /// Depth of the deepest vertex behind the other surface in the last find(), metres, >= 0.
    double deepest() const noexcept;

    /// Appends the state that the next find() uses.
    void save_sides(ContactSides& sides) const;

    /// Replaces the state by the entries of `sides` for these two bodies.
    void restore_sides(const ContactSides& sides);

 private:
    /// The last contact of a vertex.
    struct Side {
        int vertex = 0;
        Eigen::Vector3d normal;
        double depth = 0;
    };
    using Sides = std::vector<Side>;  // sorted by vertex

    void find_vertices(int body, const ContactSurface& points, int other_body, const ContactSurface& surface,
                       std::span<const FacePair> pairs, const ContactReach& reach, double moved, Sides& sides,
                       std::vector<Contact>& contacts);

    int body_a_, body_b_;
    std::vector<FacePair> flipped_;
    std::vector<int> near_faces_;
    Sides sides_a_, sides_b_;
};

}  // namespace nbd

#pragma once

#include <span>
#include <vector>

#include "collision/geometry/geometry.hpp"
#include "sim/contact/contact.hpp"
#include "sim/contact/contact_sides.hpp"
#include "sim/contact/contact_surface.hpp"

namespace nbd {

/// Finds the contacts of two bodies among face pairs that are near each other: every vertex with the nearest
/// face of the other body, and every pair of edges that cross at a distance. Remembers through which side
/// each vertex came, so that one behind the other's surface is pushed back out there and not through, and how
/// deep it was: what seems to have got deeper since than bodies can in a step lies behind a fold of a crushed
/// surface, and is no contact.
class BodyContactFinder {
 public:
    /// body_a, body_b: numbers put into the contacts.
    BodyContactFinder(int body_a, int body_b) : body_a_(body_a), body_b_(body_b) {}

    /// Appends every contact once, in an order that depends on the pairs alone; stiffness and friction stay
    /// zero. pairs: sorted, without repeats; all within reach.most() of each other, others do no harm.
    /// moved: metres by which the bodies may have come closer since the last call.
    void find(const ContactSurface& a, const ContactSurface& b, std::span<const FacePair> pairs,
              const ContactReach& reach, double moved, std::vector<Contact>& contacts);

    /// Metres by which the deepest vertex was behind the other surface in the last find(), >= 0.
    double deepest() const noexcept;

    /// Appends what find() goes by next.
    void save_sides(ContactSides& sides) const;

    /// Remembers what `sides` holds of these two bodies, and nothing else.
    void restore_sides(const ContactSides& sides);

 private:
    /// A vertex's last contact.
    struct Side {
        int vertex = 0;
        Eigen::Vector3d normal;
        double depth = 0;
    };
    using Sides = std::vector<Side>;  // by ascending vertex

    void find_vertices(int body, const ContactSurface& points, int other_body, const ContactSurface& surface,
                       std::span<const FacePair> pairs, const ContactReach& reach, double moved, Sides& sides,
                       std::vector<Contact>& contacts);

    int body_a_, body_b_;
    std::vector<FacePair> flipped_;
    std::vector<int> near_faces_;
    Sides sides_a_, sides_b_;
};

}  // namespace nbd

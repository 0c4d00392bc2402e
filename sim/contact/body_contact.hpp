#pragma once

#include <span>
#include <vector>

#include "collision/base/counting_sort.hpp"
#include "sim/contact/contact.hpp"
#include "sim/contact/contact_sides.hpp"
#include "sim/patches/posed_patches.hpp"

namespace nbd {

/// Finds the contacts of two bodies among nearby patches: each vertex with the nearest face of the other
/// body, and each pair of edges that cross at a distance. For each vertex in contact it remembers the side by
/// which the vertex came, so that a vertex behind the other's surface is pushed back out on that side, and
/// its depth. A vertex that seems deeper than the bodies' motion since then allows lies behind a fold of a
/// crushed surface and is not a contact.
class BodyContactFinder {
 public:
    /// body_a, body_b: body numbers to store in the contacts.
    BodyContactFinder(int body_a, int body_b) : body_a_(body_a), body_b_(body_b) {}

    /// Appends every contact once, by ascending vertices of a, vertices of b, edges; stiffness and friction
    /// stay zero. Closest features are sought in single precision, sixteen at a time, and those that may be
    /// the closest are measured in double precision, so that neither rounding nor the patches matter.
    /// The nearest face is that of the faces in reach, whose reach depends on their motion.
    /// a, b: posed with one origin near both bodies, for one step. pairs: sorted, without repeats, with all
    /// patches within reach.most(); more do no harm.
    /// detail: see contact_vertices() and find_edge_contacts(). moved: maximum approach of the bodies since
    /// the last call, metres.
    /// Returns how many pairs were examined one by one, in double precision: vertices with faces, edges with
    /// edges.
    long find(PosedPatches& a, PosedPatches& b, std::span<const PatchPair> pairs, const ContactReach& reach,
              ContactDetail detail, double moved, std::vector<Contact>& contacts);

    /// Depth of the deepest vertex behind the other surface in the last find(), metres, >= 0.
    double deepest() const noexcept;

    /// Appends the state that the next find() uses.
    void save_sides(ContactSides& sides) const;

    /// Replaces the state by the entries of `sides` for these two bodies.
    void restore_sides(const ContactSides& sides);

 private:
    long find_vertices(int body, const PosedPatches& points, int other_body, const PosedPatches& others,
                       std::span<const PatchPair> pairs, const ContactReach& reach, ContactDetail detail,
                       double moved, VertexSides& sides, std::vector<Contact>& contacts);

    int body_a_, body_b_;
    std::vector<PatchPair> near_, flipped_;
    CountingSort<PatchPair> counting_sort_;
    VertexSides sides_a_, sides_b_;
};

}  // namespace nbd

#pragma once

#include <memory>
#include <span>
#include <vector>

#include "collision/query/self_query.hpp"
#include "sim/contact/contact.hpp"
#include "sim/contact/contact_sides.hpp"
#include "sim/patches/contact_surface.hpp"

namespace nbd {

/// Finds where a body presses on itself: each vertex with the nearest face that it is in front of, and pairs
/// of edges that cross at a distance. What was near at rest makes no contact: faces with a common vertex, and
/// faces nearer to each other than twice self_thickness(). For each vertex in contact it remembers the side
/// by which the vertex came, as BodyContactFinder does. A vertex behind a face that it was not in contact
/// with before is no contact: the face may be on the other side of a thin part.
class SelfContactFinder {
 public:
    /// body: its number, to store in the contacts.
    explicit SelfContactFinder(int body) : body_(body) {}

    /// Appends contacts by ascending vertices, then edges; stiffness and friction stay zero. rest:
    /// positions of the nodes, [N, 3]. tree: of the surface, posed. v: velocities of the nodes, [N, 3], which
    /// they keep for `dt`. thickness: self_thickness(). error: by how much positions in the tree may be off.
    /// moved: maximum approach of parts of the body since the last call. All lengths in metres.
    void find(const ContactSurface& surface, NodesRef rest, PosedTree& tree, const Nodes& v, double dt,
              double thickness, double error, double moved, std::vector<Contact>& contacts);

    /// Of the last find().
    long face_pairs() const noexcept { return face_pairs_; }
    const QueryCounters& counters() const noexcept { return query_.counters(); }

    /// Append and replace the state that the next find() uses, as entries of the body with itself.
    void save_sides(ContactSides& sides) const;
    void restore_sides(const ContactSides& sides);

 private:
    /// A vertex and a face, or two edges, that may be near.
    struct Features {
        int a, b;
        auto operator<=>(const Features&) const = default;
    };

    void collect(const ContactSurface& surface, std::span<const FacePair> pairs, const ContactReach& reach);
    void find_vertices(const ContactSurface& surface, const ContactReach& reach, double moved,
                       std::vector<Contact>& contacts);
    void find_edges(const ContactSurface& surface, const ContactReach& reach, std::vector<Contact>& contacts);

    int body_;
    double near_at_rest_ = 0;  // distance of query_'s faces that are left out; 0: not made yet
    SelfQuery query_;
    long face_pairs_ = 0;
    Nodes motions_;  // [n, 3] of the vertices in the step, metres
    std::vector<Features> vertex_faces_, edge_pairs_;
    VertexSides sides_;
};

/// Distance at which contact of a body with itself begins: `thickness`, but no more than the mean length of
/// its surface's edges at rest, so that faces have few neighbours within it. Metres.
double self_thickness(const ContactShape& shape, double thickness);

}  // namespace nbd

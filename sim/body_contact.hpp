#pragma once

#include <span>
#include <vector>

#include "collision/geometry.hpp"
#include "sim/contact.hpp"
#include "sim/contact_sides.hpp"
#include "sim/contact_surface.hpp"
#include "sim/obstacle.hpp"

namespace nbd {

/// Finds the contacts of two bodies among face pairs that are near each other. Remembers through which side
/// each vertex came, so that one behind the other's surface is pushed back out there and not through.
class BodyContactFinder {
 public:
    /// body_a, body_b: numbers put into the contacts.
    BodyContactFinder(int body_a, int body_b) : body_a_(body_a), body_b_(body_b) {}

    /// Contacts between points at most `reach` metres apart: each vertex with the nearest face of the other
    /// body, and pairs of edges that cross at that distance. Every contact once, in an order that depends on
    /// the pairs alone. pairs: sorted; a pair that is missing costs its contacts, one too many nothing.
    /// Appends to `contacts`; stiffness and friction stay zero.
    void find(const ContactSurface& a, const ContactSurface& b, std::span<const FacePair> pairs, double reach,
              std::vector<Contact>& contacts);

    /// Appends what the next find() remembers.
    void save_sides(ContactSides& sides) const;

    /// Remembers what `sides` holds of these two bodies, and nothing else.
    void restore_sides(const ContactSides& sides);

 private:
    struct VertexFace {
        int vertex = 0, face = 0;
        auto operator<=>(const VertexFace&) const = default;
    };
    /// The normal of a vertex's last contact.
    struct Side {
        int vertex = 0;
        Eigen::Vector3d normal;
    };
    using Sides = std::vector<Side>;  // by ascending vertex

    void find_vertices(int body, const ContactSurface& points, int other_body, const ContactSurface& surface,
                       double reach, Sides& sides, std::vector<Contact>& contacts);
    void find_edges(const ContactSurface& a, const ContactSurface& b, std::span<const FacePair> pairs,
                    double reach, std::vector<Contact>& contacts);

    int body_a_, body_b_;
    std::vector<VertexFace> vertex_faces_;
    std::vector<FacePair> edge_pairs_;
    Sides sides_a_, sides_b_;
};

/// Contacts of a body's vertices that are at most `reach` metres outside an obstacle, by ascending vertex.
/// Appends; stiffness stays zero.
void find_obstacle_contacts(int body, const ContactSurface& surface, const Obstacle& obstacle, double time,
                            double reach, std::vector<Contact>& contacts);

}  // namespace nbd

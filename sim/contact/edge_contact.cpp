#include "sim/contact/edge_contact.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "collision/geometry/closest_points.hpp"
#include "collision/geometry/separation.hpp"

namespace nbd {
namespace {

/// Edges with a smaller sine of the angle between them count as parallel; their vertices make the contact.
constexpr double parallel = 1e-3;

/// An edge clears the other's surface if the cosine between the connecting line and the surface normal is
/// above this.
constexpr double clear = 1e-3;

struct Segment {
    Eigen::Vector3d p, q;
};

Segment segment(const ContactSurface& surface, int edge) {
    const auto ends = surface.topology().edges.row(edge);
    return {surface.x().row(ends[0]), surface.x().row(ends[1])};
}

Box edge_box(const ContactSurface& surface, int edge) {
    const auto ends = surface.topology().edges.row(edge);
    const Eigen::Vector3f p = surface.x_float().row(ends[0]), q = surface.x_float().row(ends[1]);
    return bounding_box({p, q, q});
}

SurfacePoint edge_point(const BodySurface& from, int edge, double t) {
    const auto ends = from.surface.topology().edges.row(edge);
    return {.body = from.body, .count = 2, .vertices = {ends[0], ends[1]}, .weights = {1 - t, t}};
}

/// Whether a segment crosses the interior of a face, up to rounding.
bool crosses_face(const ContactSurface& surface, int face, const Segment& s) {
    const auto corners = surface.F().row(face);
    const Eigen::Vector3d a = surface.x().row(corners[0]), b = surface.x().row(corners[1]),
                          c = surface.x().row(corners[2]);
    const Eigen::Vector3d normal = (b - a).cross(c - a), d = s.q - s.p;
    if (normal.dot(s.p - a) * normal.dot(s.q - a) >= 0) return false;
    const double u = d.dot((a - s.p).cross(b - s.p)), v = d.dot((b - s.p).cross(c - s.p)),
                 w = d.dot((c - s.p).cross(a - s.p));
    return (u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0);
}

bool crosses_faces_at(const ContactSurface& surface, int edge, const Segment& s) {
    const auto faces = surface.topology().edge_faces.row(edge);
    return crosses_face(surface, faces[0], s) || (faces[1] >= 0 && crosses_face(surface, faces[1], s));
}

double edge_area(const ContactSurface& surface, int edge) {
    const auto& edges = surface.topology().edges;
    return (surface.rest_areas()[edges(edge, 0)] + surface.rest_areas()[edges(edge, 1)]) / 6;
}

void find_contact(const BodySurface& a, int edge_a, const BodySurface& b, int edge_b,
                  const ContactReach& reach, std::vector<Contact>& contacts) {
    const Segment on_a = segment(a.surface, edge_a), on_b = segment(b.surface, edge_b);
    const Eigen::Vector3d along_a = on_a.q - on_a.p, along_b = on_b.q - on_b.p;
    if (along_a.cross(along_b).norm() < parallel * along_a.norm() * along_b.norm()) return;
    const ClosestPoints closest = closest_edge_edge(on_a.p, on_a.q, on_b.p, on_b.q);
    const double s = closest.weights_a[1], t = closest.weights_b[1], length = closest.distance;
    if (length > reach.most() || s <= 0 || s >= 1 || t <= 0 || t >= 1) return;
    const auto normal = [](const ContactSurface& of, int edge) {
        return edge_normal(of.topology(), of.F(), of.x(), edge);
    };
    const double above_b = closest.gap.dot(normal(b.surface, edge_b));
    const double below_a = -closest.gap.dot(normal(a.surface, edge_a));
    const double least = clear * length;
    const bool outside = length <= reach.apart && above_b > least && below_a > least;
    const bool overlapping =
        length <= reach.inside && above_b < -least && below_a < -least &&
        (crosses_faces_at(b.surface, edge_b, on_a) || crosses_faces_at(a.surface, edge_a, on_b));
    if (!outside && !overlapping) return;
    const double sign = outside ? 1 : -1;
    contacts.push_back({.a = edge_point(a, edge_a, s),
                        .b = edge_point(b, edge_b, t),
                        .normal = sign * closest.gap / length,
                        .gap = sign * length,
                        .area = std::min(edge_area(a.surface, edge_a), edge_area(b.surface, edge_b))});
}

}  // namespace

void find_edge_contacts(const BodySurface& a, const BodySurface& b, std::span<const FacePair> pairs,
                        const ContactReach& reach, std::vector<Contact>& contacts) {
    const auto most = static_cast<float>(reach.most());
    const SurfaceTopology &on_a = a.surface.topology(), &on_b = b.surface.topology();
    for (const FacePair& pair : pairs)
        for (int i = 0; i < 3; ++i) {
            const int edge_a = on_a.face_edges(pair.a, i);
            if (!on_a.owns_edge(pair.a, edge_a)) continue;
            const Box box = edge_box(a.surface, edge_a);
            if (apart(box, b.surface.face_box(pair.b), most)) continue;
            for (int j = 0; j < 3; ++j) {
                const int edge_b = on_b.face_edges(pair.b, j);
                if (on_b.owns_edge(pair.b, edge_b) && !apart(box, edge_box(b.surface, edge_b), most))
                    find_contact(a, edge_a, b, edge_b, reach, contacts);
            }
        }
}

}  // namespace nbd

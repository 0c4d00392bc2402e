#include "sim/contact/edge_contact.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "collision/geometry/closest_points.hpp"
#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

/// Edges with a smaller sine of the angle between them count as parallel; their vertices make the contact.
constexpr double parallel = 1e-3;

/// An edge clears the other's surface if the cosine between the connecting line and the surface normal is
/// above this.
constexpr double clear = 1e-3;

/// Edges that are shorter than this share of the contact distance make no contacts of their own where enough
/// is asked for. Where two of them cross, the nearest vertex is at most half their length farther from the
/// other surface, so that its contact presses long before they touch. Where samples press for the vertices of
/// a detailed surface, those that stand out do, which is not certain to be as early.
constexpr double short_share = 0.5;

struct Segment {
    Eigen::Vector3d p, q;
};

Segment segment(const ContactSurface& surface, int edge) {
    const auto ends = surface.topology().edges.row(edge);
    return {surface.x(ends[0]), surface.x(ends[1])};
}

double length_of(const ContactSurface& surface, int edge) {
    const Segment s = segment(surface, edge);
    return (s.q - s.p).norm();
}

SurfacePoint edge_point(int body, const ContactSurface& surface, int edge, double t) {
    const auto ends = surface.topology().edges.row(edge);
    return {.body = body, .count = 2, .vertices = {ends[0], ends[1]}, .weights = {1 - t, t}};
}

/// Whether a segment crosses the interior of a face, up to rounding.
bool crosses_face(const ContactSurface& surface, int face, const Segment& s) {
    const auto corners = surface.F().row(face);
    const Eigen::Vector3d a = surface.x(corners[0]), b = surface.x(corners[1]), c = surface.x(corners[2]);
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

/// Maximum distance that a point of one edge may move relative to a point of the other, metres.
float relative_motion(const PosedPatches& a, int edge_a, const PosedPatches& b, int edge_b) {
    float most = 0;
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j)
            most = std::max(most, (a.motion(a.surface().topology().edges(edge_a, i)) -
                                   b.motion(b.surface().topology().edges(edge_b, j)))
                                      .norm());
    return most;
}

/// How far edges reach, of which the longer has this length. Farther apart, a vertex of one of them is almost
/// as near to the other surface as they are, so that contacts of edges would only repeat those of vertices.
ContactReach edge_reach(const ContactReach& reach, double longest) {
    return {.apart = std::min(reach.apart, longest),
            .inside = std::min(reach.inside, longest),
            .approach = reach.approach};
}

}  // namespace

std::optional<Contact> edge_contact(const EdgeOfBody& a, const EdgeOfBody& b,
                                    const ContactReach& surface_reach, double motion) {
    const ContactSurface &in_a = a.surface, &in_b = b.surface;
    const Segment on_a = segment(in_a, a.edge), on_b = segment(in_b, b.edge);
    const Eigen::Vector3d along_a = on_a.q - on_a.p, along_b = on_b.q - on_b.p;
    const double length_a = along_a.norm(), length_b = along_b.norm();
    const ContactReach reach = edge_reach(surface_reach, std::max(length_a, length_b));
    constexpr double slack = 1 + 1e-12;  // for what rounding does to the distance of the middles
    if (((on_a.p - on_b.p) + (on_a.q - on_b.q)).norm() > slack * (2 * reach.most() + length_a + length_b))
        return std::nullopt;
    if (along_a.cross(along_b).norm() < parallel * length_a * length_b) return std::nullopt;
    const ClosestPoints closest = closest_edge_edge(on_a.p, on_a.q, on_b.p, on_b.q);
    const double s = closest.weights_a[1], t = closest.weights_b[1], length = closest.distance;
    if (length > reach.most() || s <= 0 || s >= 1 || t <= 0 || t >= 1) return std::nullopt;
    const double approach = length > std::min(reach.apart, reach.inside) ? motion : 0;
    const double above_b = closest.gap.dot(in_b.edge_normal(b.edge));
    const double below_a = -closest.gap.dot(in_a.edge_normal(a.edge));
    const double least = clear * length;
    const bool outside = length <= reach.apart + approach && above_b > least && below_a > least;
    const bool overlapping = length <= reach.inside + approach && above_b < -least && below_a < -least &&
                             (crosses_faces_at(in_b, b.edge, on_a) || crosses_faces_at(in_a, a.edge, on_b));
    if (!outside && !overlapping) return std::nullopt;
    const double sign = outside ? 1 : -1;
    return Contact{.a = edge_point(a.body, in_a, a.edge, s),
                   .b = edge_point(b.body, in_b, b.edge, t),
                   .normal = sign * closest.gap / length,
                   .gap = sign * length,
                   .area = std::min(edge_area(in_a, a.edge), edge_area(in_b, b.edge))};
}

namespace {

/// An edge in single precision: from p, along d.
struct FloatEdge {
    FloatEdge(const PosedEdges& pack, std::size_t lane)
        : squared(pack.squared[lane]), inverse_length(pack.inverse_length[lane]) {
        for (std::size_t i = 0; i < 3; ++i) p[i] = pack.p[i][lane], d[i] = pack.d[i][lane];
    }
    std::array<float, 3> p, d;
    float squared, inverse_length;
};

/// Whether points of the box may be in reach of the edge and between the planes across its ends, where points
/// are that are closest to its interior.
bool may_face(const FloatEdge& edge, const PatchBounds& box, float reach, float tolerance) noexcept {
    float squared = 0, middle = 0, spread = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const float q = edge.p[i] + edge.d[i], low = std::min(edge.p[i], q), high = std::max(edge.p[i], q);
        const float gap = std::max({box.lo[i] - high, low - box.hi[i], 0.f});
        squared += gap * gap;
        middle += ((box.lo[i] + box.hi[i]) / 2 - edge.p[i]) * edge.d[i];
        spread += ((box.hi[i] - box.lo[i]) / 2 + 4 * tolerance) * std::abs(edge.d[i]);
    }
    return squared <= reach * reach && middle + spread >= 0 && middle - spread <= edge.squared;
}

using LaneFlags = std::array<std::int32_t, ContactPatches::width>;

/// Flags the edges of the pack whose closest points with `edge` may be interior to both and within reach.
/// Rounding errors of positions grow as the edges become parallel: `slack` bounds what they do to the places
/// of these points along the edges, as shares of their lengths. Returns whether any is flagged.
bool flag_facing(const FloatEdge& edge, const PosedEdges& pack, float reach, float tolerance,
                 LaneFlags& flags) noexcept {
    constexpr float least_sine_squared = 2e-7f;  // below it edges are parallel, in spite of rounding
    const float ux = edge.d[0], uy = edge.d[1], uz = edge.d[2], length = std::sqrt(edge.squared);
    std::int32_t any = 0;
    for (std::size_t k = 0; k < ContactPatches::width; ++k) {
        const float vx = pack.d[0][k], vy = pack.d[1][k], vz = pack.d[2][k];
        const float wx = edge.p[0] - pack.p[0][k], wy = edge.p[1] - pack.p[1][k],
                    wz = edge.p[2] - pack.p[2][k];
        const float u_v = ux * vx + uy * vy + uz * vz, u_w = ux * wx + uy * wy + uz * wz,
                    v_w = vx * wx + vy * wy + vz * wz, w_most = std::abs(wx) + std::abs(wy) + std::abs(wz);
        const float both = edge.squared * pack.squared[k], crossing = both - u_v * u_v,
                    inverse = 1 / crossing;
        const float s = (u_v * v_w - pack.squared[k] * u_w) * inverse,
                    t = (edge.squared * v_w - u_v * u_w) * inverse;
        const float inverse_lengths = edge.inverse_length + pack.inverse_length[k];
        const float slack = 4 * tolerance * (1 + w_most * inverse_lengths) * inverse_lengths * both * inverse;
        const float gx = wx + s * ux - t * vx, gy = wy + s * uy - t * vy, gz = wz + s * uz - t * vz;
        const float most = reach + slack * (length + pack.squared[k] * pack.inverse_length[k]);
        flags[k] = (crossing > least_sine_squared * both) & (s > -slack) & (s < 1 + slack) & (t > -slack) &
                   (t < 1 + slack) & (gx * gx + gy * gy + gz * gz <= most * most);
        any |= flags[k];
    }
    return any != 0;
}

}  // namespace

long find_edge_contacts(const BodyPatches& a, const BodyPatches& b, std::span<const PatchPair> pairs,
                        const ContactReach& reach, ContactDetail detail, std::vector<Contact>& contacts) {
    constexpr std::size_t width = ContactPatches::width;
    const float tolerance = a.patches.tolerance() + b.patches.tolerance(), room = 8 * tolerance;
    const auto reach_of = [&](const PatchPair& pair) {
        const PatchBounds &s = a.patches.bounds(pair.a), &t = b.patches.bounds(pair.b);
        const double longest = std::max(s.longest_edge, t.longest_edge) + room;
        if (detail == ContactDetail::enough && longest <= short_share * reach.apart) return -1.f;
        return static_cast<float>(edge_reach(reach, longest).least() +
                                  std::min(reach.approach, double{relative_motion(s, t)})) +
               room;
    };
    std::vector<PatchPair> near;
    for (const PatchPair& pair : pairs)
        if (const float most = reach_of(pair);
            most >= 0 && squared_distance(a.patches.bounds(pair.a), b.patches.bounds(pair.b)) <= most * most)
            near.push_back(pair);
    a.patches.require_edges(near, &PatchPair::a);
    b.patches.require_edges(near, &PatchPair::b);
    const ContactPatches &in_a = a.patches.surface().patches(), &in_b = b.patches.surface().patches();
    struct EdgePair {
        int a, b;
        auto operator<=>(const EdgePair&) const = default;
    };
    constexpr int pairs_per_task = 256;
    const int tasks = (static_cast<int>(near.size()) + pairs_per_task - 1) / pairs_per_task;
    std::vector<std::vector<EdgePair>> found(tasks);
    // Two edges of at most this length make no contact.
    const double shortest = detail == ContactDetail::enough ? short_share * reach.apart : 0;
    const auto surely_short = static_cast<float>(std::max(0.0, shortest - room));
    const auto search = [&](const PatchPair& pair, std::vector<EdgePair>& facing) {
        LaneFlags flags;
        const float others = b.patches.bounds(pair.b).longest_edge;
        const float most = reach_of(pair);
        const PosedEdges *packs_a = a.patches.edges(pair.a), *packs_b = b.patches.edges(pair.b);
        const auto edges_a = in_a.edges[pair.a], edges_b = in_b.edges[pair.b];
        for (std::size_t i = 0; i < edges_a.size(); ++i) {
            const FloatEdge edge(packs_a[i / width], i % width);
            const bool is_short = edge.squared <= surely_short * surely_short;
            if (is_short && others <= surely_short) continue;
            if (!may_face(edge, b.patches.bounds(pair.b), most, tolerance)) continue;
            for (std::size_t first = 0; first < edges_b.size(); first += width) {
                const PosedEdges& pack = packs_b[first / width];
                if (is_short && pack.longest_squared <= surely_short * surely_short) continue;
                if (!flag_facing(edge, pack, most, tolerance, flags)) continue;
                const std::size_t count = std::min(width, edges_b.size() - first);
                for (std::size_t k = 0; k < count; ++k)
                    if (flags[k]) facing.push_back({edges_a[i], edges_b[first + k]});
            }
        }
    };
    parallel_for(
        tasks,
        [&](int task) {
            const std::size_t first = task * pairs_per_task;
            for (std::size_t k = first; k < std::min(first + pairs_per_task, near.size()); ++k)
                search(near[k], found[task]);
        },
        1);
    std::vector<EdgePair> facing;
    for (const std::vector<EdgePair>& part : found) facing.insert(facing.end(), part.begin(), part.end());
    std::ranges::sort(facing);
    long measured = 0;
    for (const EdgePair& pair : facing) {
        // Patches with short edges alone were left out; of the others, edges are judged one by one, so that
        // contacts do not depend on which edges lie in one patch.
        if (std::max(length_of(a.patches.surface(), pair.a), length_of(b.patches.surface(), pair.b)) <=
            shortest)
            continue;
        const double motion =
            std::min(reach.approach, double{relative_motion(a.patches, pair.a, b.patches, pair.b)});
        ++measured;
        if (const std::optional<Contact> contact = edge_contact(
                {a.body, a.patches.surface(), pair.a}, {b.body, b.patches.surface(), pair.b}, reach, motion))
            contacts.push_back(*contact);
    }
    return measured;
}

}  // namespace nbd

#include "sim/scene/region.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <stdexcept>
#include <type_traits>

#include "meshing/surface/quadratic_tets.hpp"

namespace nbd {
namespace {

using Mask = std::vector<char>;

double distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const Eigen::Vector3d way = b - a;
    const double squared = way.squaredNorm();
    const double share = squared > 0 ? std::clamp((p - a).dot(way) / squared, 0.0, 1.0) : 0;
    return (p - a - share * way).norm();
}

bool contains(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& p) { return box.contains(p); }
bool contains(const BallShape& ball, const Eigen::Vector3d& p) {
    return (p - ball.centre).norm() <= ball.radius;
}
bool contains(const CapsuleShape& capsule, const Eigen::Vector3d& p) {
    return distance_to_segment(p, capsule.from, capsule.to) <= capsule.radius;
}
bool contains(const NearSurface& near, const Eigen::Vector3d& p) {
    const std::optional<SurfaceDistance> at = signed_distance(*near.surface, p, 0, near.distance);
    return at && std::abs(at->distance) <= near.distance;
}

/// Selects parts of one kind in a body.
class RegionSelector {
 public:
    RegionSelector(const std::string& key, BodyPart part, const PlacedBody& placed)
        : key_(key), part_(part), body_(placed.body), x_(placed.x) {}

    Mask select(const Region& region) {
        return std::visit([&](const auto& part) { return of(part, region); }, region.part);
    }

 private:
    [[noreturn]] void refuse(const std::string& what) const {
        throw std::invalid_argument(fmt::format("{}: {}", key_, what));
    }

    int count() const {
        switch (part_) {
            case BodyPart::node:
                return x_.rows();
            case BodyPart::vertex:
                return body_.surface.X.rows();
            case BodyPart::face:
                return body_.surface.F.rows();
            case BodyPart::tet:
                break;
        }
        return body_.tets.T.rows();
    }

    /// Faces whose three vertices are marked.
    Mask faces_of(const Mask& vertices) const {
        const Faces& F = body_.surface.F;
        Mask faces(F.rows(), 0);
        for (Eigen::Index f = 0; f < F.rows(); ++f)
            faces[f] = vertices[F(f, 0)] && vertices[F(f, 1)] && vertices[F(f, 2)] ? 1 : 0;
        return faces;
    }

    template <class Shape>
    Mask of(const Shape& shape, const Region&) {
        if constexpr (std::is_same_v<Shape, NearSurface>)
            if (!shape.surface)
                refuse(fmt::format("the {} \"{}\" that it is near to could not be loaded",
                                   shape.body.empty() ? "obstacle" : "body",
                                   shape.body.empty() ? shape.obstacle : shape.body));
        const auto inside = [&](const Nodes& points) {
            Mask mask(points.rows(), 0);
            for (Eigen::Index i = 0; i < points.rows(); ++i)
                mask[i] = contains(shape, points.row(i).transpose()) ? 1 : 0;
            return mask;
        };
        if (part_ == BodyPart::node) return inside(x_);
        if (part_ == BodyPart::tet) {
            const Tets& T = body_.tets.T;
            Nodes centres(T.rows(), 3);
            for (Eigen::Index t = 0; t < T.rows(); ++t)
                centres.row(t) =
                    0.25 * (x_.row(T(t, 0)) + x_.row(T(t, 1)) + x_.row(T(t, 2)) + x_.row(T(t, 3)));
            return inside(centres);
        }
        const Mask vertices = inside(embedded(body_.W, x_));
        return part_ == BodyPart::vertex ? vertices : faces_of(vertices);
    }

    /// What belongs to marked nodes.
    Mask of_nodes(const Mask& nodes) const {
        if (part_ == BodyPart::node) return nodes;
        if (part_ == BodyPart::tet) {
            const Tets& T = body_.tets.T;
            Mask tets(T.rows(), 0);
            for (Eigen::Index t = 0; t < T.rows(); ++t)
                tets[t] =
                    std::ranges::all_of(std::array{0, 1, 2, 3}, [&](int k) { return nodes[T(t, k)] != 0; });
            return tets;
        }
        Mask vertices(body_.W.rows(), 0);
        for (Eigen::Index v = 0; v < body_.W.rows(); ++v) {
            vertices[v] = 1;
            for (Embedding::InnerIterator entry(body_.W, v); entry; ++entry)
                if (entry.value() != 0 && !nodes[entry.col()]) vertices[v] = 0;
        }
        return part_ == BodyPart::vertex ? vertices : faces_of(vertices);
    }

    /// What belongs to these faces.
    Mask of_faces(const std::vector<int>& faces) const {
        if (part_ == BodyPart::tet)
            refuse("these are faces; allowed: a part of space, or a group of tetrahedra");
        Mask mask(count(), 0);
        const Faces& F = body_.surface.F;
        std::set<std::array<int, 2>> edges;  // between nodes of corners
        for (const int f : faces) {
            if (part_ == BodyPart::face) mask[f] = 1;
            std::array<int, 3> corners{-1, -1, -1};
            for (int k = 0; k < 3; ++k) {
                if (part_ == BodyPart::vertex) mask[F(f, k)] = 1;
                if (part_ != BodyPart::node) continue;
                for (Embedding::InnerIterator entry(body_.W, F(f, k)); entry; ++entry) {
                    if (entry.value() != 0) mask[entry.col()] = 1;
                    if (entry.value() == 1) corners[k] = entry.col();
                }
            }
            for (int k = 0; k < 3; ++k)
                edges.insert(
                    {std::min(corners[k], corners[(k + 1) % 3]), std::max(corners[k], corners[(k + 1) % 3])});
        }
        if (part_ != BodyPart::node) return mask;
        // In the middles of edges, quadratic tetrahedra have nodes that no vertex hangs on.
        for (Eigen::Index t = 0; t < body_.tets.E.rows(); ++t)
            for (std::size_t e = 0; e < edges_of_tet.size(); ++e) {
                const int a = body_.tets.T(t, edges_of_tet[e].first),
                          b = body_.tets.T(t, edges_of_tet[e].second);
                if (edges.contains({std::min(a, b), std::max(a, b)})) mask[body_.tets.E(t, e)] = 1;
            }
        return mask;
    }

    void check_rows(const std::vector<int>& rows, Eigen::Index count, const char* what) const {
        for (const int row : rows)
            if (row < 0 || row >= count)
                refuse(fmt::format("the body has no {} {}; allowed: 0 to {}", what, row, count - 1));
    }

    Mask of(const NodeList& list, const Region&) {
        check_rows(list.rows, x_.rows(), "node");
        Mask nodes(x_.rows(), 0);
        for (const int row : list.rows) nodes[row] = 1;
        return of_nodes(nodes);
    }

    Mask of(const FaceList& list, const Region&) {
        check_rows(list.rows, body_.surface.F.rows(), "face");
        return of_faces(list.rows);
    }

    Mask of(const NamedGroup& group, const Region&) {
        const auto tets = std::ranges::find(body_.regions, group.name, &MaterialRegion::name);
        const auto faces = std::ranges::find(body_.face_groups, group.name, &FaceGroup::name);
        const bool is_of_tets = tets != body_.regions.end(), is_of_faces = faces != body_.face_groups.end();
        if (!is_of_tets && !is_of_faces) {
            std::string names;
            for (const MaterialRegion& region : body_.regions)
                names += (names.empty() ? "" : ", ") + region.name;
            for (const FaceGroup& one : body_.face_groups) names += (names.empty() ? "" : ", ") + one.name;
            refuse(fmt::format("the body has no group \"{}\"; allowed: {}", group.name,
                               names.empty() ? "none, it has no groups" : names));
        }
        const bool on_surface = part_ == BodyPart::vertex || part_ == BodyPart::face;
        if (!is_of_tets || (is_of_faces && on_surface)) return of_faces(faces->faces);
        if (part_ == BodyPart::tet) {
            Mask mask(count(), 0);
            for (const int t : tets->tets) mask[t] = 1;
            return mask;
        }
        Mask nodes(x_.rows(), 0);
        for (const int t : tets->tets) {
            for (const int node : body_.tets.T.row(t)) nodes[node] = 1;
            if (!body_.tets.is_quadratic()) continue;
            for (const int node : body_.tets.E.row(t)) nodes[node] = 1;
        }
        return of_nodes(nodes);
    }

    Mask of(const Combination& how, const Region& region) {
        Mask mask(count(), how == Combination::any ? 0 : 1);
        for (const Region& one : region.of) {
            const Mask more = select(one);
            for (std::size_t i = 0; i < mask.size(); ++i) {
                if (how == Combination::all) mask[i] = mask[i] && more[i] ? 1 : 0;
                if (how == Combination::any) mask[i] = mask[i] || more[i] ? 1 : 0;
                if (how == Combination::none) mask[i] = mask[i] && !more[i] ? 1 : 0;
            }
        }
        return mask;
    }

    const std::string& key_;
    BodyPart part_;
    const Body& body_;
    const Nodes& x_;
};

}  // namespace

void move(Region& region, const Eigen::Vector3d& by) {
    if (auto* box = std::get_if<Eigen::AlignedBox3d>(&region.part)) box->translate(by);
    if (auto* ball = std::get_if<BallShape>(&region.part)) ball->centre += by;
    if (auto* capsule = std::get_if<CapsuleShape>(&region.part)) {
        capsule->from += by;
        capsule->to += by;
    }
}

std::vector<int> parts_in(const std::string& key, const Region& region, BodyPart part,
                          const PlacedBody& placed) {
    const Mask mask = RegionSelector(key, part, placed).select(region);
    std::vector<int> rows;
    for (std::size_t i = 0; i < mask.size(); ++i)
        if (mask[i]) rows.push_back(static_cast<int>(i));
    return rows;
}

}  // namespace nbd

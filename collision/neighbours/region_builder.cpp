#include "collision/neighbours/region_builder.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "collision/geometry/closest_points.hpp"
#include "collision/neighbours/local_map.hpp"

namespace nbd {
namespace {

/// A face is not covered if it is nearer to the leaf than this share of the leaf's longest edge: the proof
/// would hardly ever hold.
constexpr double least_distance = 0.2;

constexpr double distance_rounding = 1e-6;  // relative; more than that of distances

Triangle triangle(const Nodes& X, FacesRef F, int face) {
    const auto corner = [&](int k) { return Eigen::Vector3f(X.row(F(face, k)).transpose().cast<float>()); };
    return {corner(0), corner(1), corner(2)};
}

bool share_a_corner(const std::array<int, 3>& a, const std::array<int, 3>& b) {
    return std::ranges::any_of(a, [&](int v) { return std::ranges::find(b, v) != b.end(); });
}

}  // namespace

FacePlaces::FacePlaces(const WideTree& tree) {
    for (std::size_t slot = 0; slot < tree.faces.size(); ++slot) {
        if (tree.faces[slot] < 0) continue;
        const std::size_t face = tree.faces[slot];
        if (leaf.size() <= face) {
            leaf.resize(face + 1, -1);
            this->slot.resize(face + 1, 0);
        }
        leaf[face] = static_cast<int>(slot) / tree_width;
        this->slot[face] = static_cast<std::uint8_t>(slot % tree_width);
    }
}

RegionBuilder::RegionBuilder(const Surface& surface)
    : surface_(surface),
      coordinate_error_(0x1p-24 * surface.X.cwiseAbs().maxCoeff()),
      paths_(surface.graph, surface.X),
      is_inside_(surface.X.rows(), 0) {}

RegionBuilder::Face RegionBuilder::face_of(int face) const {
    const auto corner = [&](int k) { return surface_.X.row(surface_.F(face, k % 3)); };
    Face f{.face = face,
           .corners = {},
           .centre = (corner(0) + corner(1) + corner(2)) / 3,
           .radius = 0,
           .longest_edge = 0};
    for (int k = 0; k < 3; ++k) {
        f.corners[k] = surface_.F(face, k);
        f.radius = std::max(f.radius, (corner(k) - f.centre).norm());
        f.longest_edge = std::max(f.longest_edge, (corner(k) - corner(k + 1)).norm());
    }
    return f;
}

RegionBuilder::Lists RegionBuilder::build(int leaf) {
    const std::span<const int> own = surface_.tree.leaf_vertices(leaf);
    Lists lists{.vertices = {own.begin(), own.end()},
                .covered = {},
                .distance = std::numeric_limits<double>::infinity(),
                .longest_edge = 0};
    paths_.grow(lists.vertices, surface_.radius, most_region_vertices);
    own_.clear();
    for (int k = 0; k < surface_.tree.faces_in[leaf]; ++k) {
        own_.push_back(face_of(surface_.tree.faces[tree_width * leaf + k]));
        lists.longest_edge = std::max(lists.longest_edge, own_.back().longest_edge);
    }
    enclose_own();
    const double edge = lists.longest_edge, least = least_distance * edge;
    for (const int number : faces_between(lists.vertices)) {
        const Face face = face_of(number);
        const double balls = (face.centre - own_centre_).norm() - face.radius - own_radius_;
        double distance = balls * (1 - distance_rounding);
        if (distance < std::max(least, lists.distance))
            distance = distance_to_leaf(face, least, std::min(edge, lists.distance));
        if (distance < least) continue;
        const int at = surface_.places.leaf[number];
        if (lists.covered.empty() || lists.covered.back().leaf != at) lists.covered.push_back({at, 0});
        lists.covered.back().faces |= static_cast<std::uint16_t>(1u << surface_.places.slot[number]);
        lists.distance = std::min(lists.distance, distance);
        lists.longest_edge = std::max(lists.longest_edge, face.longest_edge);
    }
    return lists;
}

/// Faces whose vertices are all among these, by leaves and slots.
std::vector<int> RegionBuilder::faces_between(std::span<const int> vertices) {
    for (const int v : vertices) is_inside_[v] = 1;
    std::vector<int> found;
    for (const int v : vertices)
        for (const int face : surface_.graph.faces(v)) {
            const auto row = surface_.F.row(face);
            if (std::all_of(row.begin(), row.end(), [&](int corner) { return is_inside_[corner]; }))
                found.push_back(face);
        }
    for (const int v : vertices) is_inside_[v] = 0;
    const auto place = [&](int face) {
        const std::size_t f = face;
        return tree_width * surface_.places.leaf[f] + surface_.places.slot[f];
    };
    std::ranges::sort(found, {}, place);
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
}

/// A lower bound on the distance of a face to the leaf's faces, exact where it is between `least` and
/// `enough`. Infinite if no pair needs a proof.
double RegionBuilder::distance_to_leaf(const Face& face, double least, double enough) {
    candidates_.clear();
    for (const Face& own : own_)
        if (!share_a_corner(own.corners, face.corners) &&
            !(surface_.left_out && surface_.left_out->contains(own.face, face.face)))
            candidates_.push_back({lower_bound(own, face), &own});
    std::ranges::sort(candidates_, {}, &Candidate::bound);
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& [bound, own] : candidates_) {
        if (bound >= nearest || nearest < least) break;
        nearest = std::min(nearest, bound >= enough ? bound : std::max(bound, measured(*own, face)));
    }
    return nearest;
}

/// A ball around the faces of the leaf.
void RegionBuilder::enclose_own() {
    own_centre_.setZero();
    own_radius_ = 0;
    for (const Face& own : own_) own_centre_ += own.centre / static_cast<double>(own_.size());
    for (const Face& own : own_)
        own_radius_ = std::max(own_radius_, (own.centre - own_centre_).norm() + own.radius);
}

/// A lower bound on the distance of two faces from balls around them and a plane between them.
double RegionBuilder::lower_bound(const Face& a, const Face& b) const {
    const Eigen::RowVector3d along = b.centre - a.centre;
    const double length = along.norm(), balls = length - a.radius - b.radius;
    double end_a = -std::numeric_limits<double>::infinity(), begin_b = -end_a;
    for (const int v : a.corners) end_a = std::max(end_a, along.dot(surface_.X.row(v) - a.centre));
    for (const int v : b.corners) begin_b = std::min(begin_b, along.dot(surface_.X.row(v) - a.centre));
    const double slab = length > 0 ? (begin_b - end_a) / length : 0;
    return std::max({0.0, balls, slab, surface_.left_out_distance}) * (1 - distance_rounding);
}

/// The distance of two faces, less what rounding may add; negative for some that touch.
double RegionBuilder::measured(const Face& a, const Face& b) const {
    const double distance =
        triangle_distance(triangle(surface_.X, surface_.F, a.face), triangle(surface_.X, surface_.F, b.face));
    return distance * (1 - distance_rounding) - 4 * coordinate_error_;
}

}  // namespace nbd

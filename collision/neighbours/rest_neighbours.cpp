#include "collision/neighbours/rest_neighbours.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/geometry/closest_points.hpp"
#include "collision/neighbours/edge_paths.hpp"
#include "collision/neighbours/local_map.hpp"

namespace nbd {
namespace {

constexpr int leaves_a_builder = 512;

template <class List>
void append(const List& from, List& to) {
    to.insert(to.end(), from.begin(), from.end());
}

template <class Item>
std::span<const Item> part(const std::vector<Item>& items, std::size_t begin, std::size_t end) noexcept {
    return std::span(items).subspan(begin, end - begin);
}

void check_length(const char* what, double length) {
    if (!(length >= 0 && std::isfinite(length)))
        throw std::invalid_argument(message(what, " is ", length, " m, allowed: finite, 0 or more"));
}

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

/// Where the faces of a tree are.
struct FacePlaces {
    explicit FacePlaces(const WideTree& tree) {
        for (std::size_t place = 0; place < tree.faces.size(); ++place) {
            if (tree.faces[place] < 0) continue;
            const std::size_t face = tree.faces[place];
            if (leaf.size() <= face) {
                leaf.resize(face + 1, -1);
                slot.resize(face + 1, 0);
            }
            leaf[face] = static_cast<int>(place) / tree_width;
            slot[face] = static_cast<std::uint8_t>(place % tree_width);
        }
    }
    std::vector<int> leaf;           // [m]
    std::vector<std::uint8_t> slot;  // [m] position in the leaf
};

/// Finds the region around a leaf, and how near its faces are to the leaf's. One object per thread.
class RegionBuilder {
 public:
    struct Surface {
        const Nodes& X;
        FacesRef F;
        const WideTree& tree;
        const FacePlaces& places;
        const EdgeGraph& graph;
        const FacePairSet* left_out;  // null: none
        double left_out_distance;     // see RestNeighbours
        double radius;
    };
    /// As RestNeighbours::Region has them.
    struct Lists {
        std::vector<int> vertices;
        std::vector<RestNeighbours::Covered> covered;
        double distance, longest_edge;
    };

    /// surface: what it refers to must outlive this object.
    explicit RegionBuilder(const Surface& surface);
    Lists build(int leaf);

 private:
    struct Face {
        int face;
        std::array<int, 3> corners;
        Eigen::RowVector3d centre;
        double radius;        // of a ball around the centre
        double longest_edge;  // metres
    };
    Face face_of(int face) const;
    std::vector<int> faces_between(std::span<const int> vertices);
    void enclose_own();
    double lower_bound(const Face& a, const Face& b) const;
    double measured(const Face& a, const Face& b) const;
    double distance_to_leaf(const Face& face, double least, double enough);

    const Surface surface_;
    const double coordinate_error_;  // of positions in single precision, metres
    EdgePaths paths_;
    std::vector<char> is_inside_;  // [n] whether a vertex is in the region
    std::vector<Face> own_;        // faces of the leaf
    Eigen::RowVector3d own_centre_ = Eigen::RowVector3d::Zero();
    double own_radius_ = 0;  // of a ball around them
    struct Candidate {
        double bound;  // of the distance
        const Face* own;
    };
    std::vector<Candidate> candidates_;  // scratch
};

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

}  // namespace

RestNeighbours::RestNeighbours(const Nodes& X, FacesRef F, const WideTree& tree,
                               std::shared_ptr<const FacePairSet> left_out, double left_out_distance,
                               double radius, const Executor& run)
    : tree_(&tree), left_out_(std::move(left_out)) {
    if (!is_over(tree, X.rows(), F)) throw std::invalid_argument("the tree is not over these faces");
    if (left_out_ && left_out_->face_count() != F.rows())
        throw std::invalid_argument(message("the pairs to leave out are of ", left_out_->face_count(),
                                            " faces, but the surface has ", F.rows()));
    check_length("left_out_distance", left_out_distance);
    check_length("radius", radius);
    if (!X.allFinite()) throw std::invalid_argument("a rest position is not finite");
    const FacePlaces places(tree);
    const EdgeGraph graph(F, X.rows());
    const RegionBuilder::Surface surface{X,     F, tree, places, graph, left_out_.get(), left_out_distance,
                                         radius};
    std::vector<RegionBuilder::Lists> built(tree.leaves());
    run((tree.leaves() + leaves_a_builder - 1) / leaves_a_builder, [&](int task) {
        RegionBuilder builder(surface);
        for (int leaf = task * leaves_a_builder;
             leaf < std::min((task + 1) * leaves_a_builder, tree.leaves()); ++leaf)
            built[leaf] = builder.build(leaf);
    });
    leaves_.resize(built.size() + 1);
    for (std::size_t l = 0; l < built.size(); ++l) {
        append(built[l].vertices, vertices_);
        append(built[l].covered, covered_);
        leaves_[l].distance = built[l].distance;
        leaves_[l].longest_edge = built[l].longest_edge;
        leaves_[l + 1].vertices = vertices_.size();
        leaves_[l + 1].covered = covered_.size();
    }
    points_.resize(3 * vertices_.size());
    run(tree.leaves(), [&](int leaf) {
        place_leaf(leaf, X);
        fit_leaf(leaf);
    });
}

/// Stores the points of a region in single precision, and what holds for the points as they are stored.
void RestNeighbours::place_leaf(int leaf, const Nodes& X) {
    Leaf& of_leaf = leaves_[leaf];
    const std::span<const int> vertices = region(leaf).vertices;
    if (vertices.empty()) return;
    Eigen::AlignedBox3d box;
    for (const int v : vertices) box.extend(X.row(v).transpose());
    constexpr double rounding = 1e-6;  // of points in single precision, and of their distances, over the size
    of_leaf.centre = box.center();
    of_leaf.size = std::max(box.sizes().maxCoeff() / 2, 1e-30);
    of_leaf.half = (box.sizes() / (2 * of_leaf.size)).array() + rounding;
    of_leaf.distance -= rounding * of_leaf.size;
    of_leaf.longest_edge += rounding * of_leaf.size;
    const LocalPoints Z = local_points(X, vertices, of_leaf.centre, of_leaf.size);
    Eigen::Map<Eigen::Matrix<float, 3, Eigen::Dynamic, Eigen::RowMajor>>(
        points_.data() + 3 * of_leaf.vertices, 3, Z.cols()) = Z.cast<float>();
}

void RestNeighbours::fit_leaf(int leaf) {
    const Region of_leaf = region(leaf);
    if (of_leaf.vertices.empty()) return;
    const LocalPoints Z = local_points(of_leaf.points);
    const TermMatrix T = terms(Z);
    // A little is added to directions that nothing determines.
    Fit sum = 1e-9 * static_cast<double>(Z.cols()) * Fit::Identity();
    sum += T * T.transpose();
    for_each_normal(*tree_, leaf, Z, [&](const MapTerms& slopes, double weight, int, int, int) {
        sum += weight * slopes * slopes.transpose();
    });
    leaves_[leaf].fit = sum.inverse();
}

RestNeighbours::Region RestNeighbours::region(int leaf) const noexcept {
    const Leaf &from = leaves_[leaf], &to = leaves_[static_cast<std::size_t>(leaf) + 1];
    return {.vertices = part(vertices_, from.vertices, to.vertices),
            .points = part(points_, 3 * from.vertices, 3 * to.vertices),
            .covered = part(covered_, from.covered, to.covered),
            .distance = from.distance,
            .longest_edge = from.longest_edge,
            .centre = from.centre,
            .size = from.size,
            .half = from.half,
            .fit = from.fit};
}

unsigned RestNeighbours::covered(int leaf, int other) const noexcept {
    const std::span<const Covered> all = region(leaf).covered;
    const auto found = std::ranges::lower_bound(all, other, {}, &Covered::leaf);
    return found != all.end() && found->leaf == other ? found->faces : 0;
}

}  // namespace nbd

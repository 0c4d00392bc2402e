#include "collision/neighbours/rest_neighbours.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/neighbours/leaf_normals.hpp"
#include "collision/neighbours/local_map.hpp"
#include "collision/neighbours/region_builder.hpp"

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

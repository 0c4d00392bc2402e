#include "collision/wide_tree/affine_parts.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "collision/base/prefetch.hpp"
#include "collision/kernels/box_pack.hpp"

namespace nbd {
namespace {

constexpr std::size_t lanes = 16;

std::size_t longest(const AffineParts::Children& carriers) {
    std::size_t most = 0;
    for (const std::vector<int>& list : carriers) most = std::max(most, list.size());
    return most;
}

/// Entry i of a list made longer: the nodes of a short list repeat in turn, so that each counts about as
/// often; those of an empty one are `other`.
int entry(const std::vector<int>& list, std::size_t i, int other) {
    return list.empty() ? other : list[i % list.size()];
}

/// Rest coordinates of some nodes, of which some may repeat, in a frame around their mean, as integers. A map
/// is fitted as if they had no mean at all; integers make it vanish nearly.
class Frame {
 public:
    Frame(const std::vector<int>& nodes, VerticesRef rest) : rest_(rest) {
        for (const int node : nodes) mean_ += position(node) / static_cast<double>(nodes.size());
        double most = 0;
        for (const int node : nodes) most = std::max(most, (position(node) - mean_).cwiseAbs().maxCoeff());
        unit_ = most > 0 ? 32767 / most : 0;
    }
    Eigen::Vector3d of_node(int node) const {
        return ((position(node) - mean_) * unit_).array().round().matrix();
    }
    Eigen::Vector3d of_point(const Eigen::RowVector3f& p) const {
        return (p.cast<double>().transpose() - mean_) * unit_;
    }
    /// W rest of a vertex; it hangs on no other nodes.
    Eigen::Vector3d of_vertex(int vertex, const SurfaceEmbedding& W) const {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (SurfaceEmbedding::InnerIterator entry(W, vertex); entry; ++entry)
            if (entry.value() != 0) sum += double{entry.value()} * of_node(entry.col());
        return sum;
    }

 private:
    Eigen::Vector3d position(int node) const { return rest_.row(node).cast<double>().transpose(); }

    VerticesRef rest_;
    Eigen::Vector3d mean_ = Eigen::Vector3d::Zero();
    double unit_ = 0;
};

/// The inverse of sum r r^T where nodes spread; directions in which they hardly do get no gradient.
std::array<float, 6> inverse_moments(const Eigen::Matrix3d& sum) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum);
    const Eigen::Vector3d values = solver.eigenvalues();
    Eigen::Vector3d inverse = Eigen::Vector3d::Zero();
    for (int a = 0; a < 3; ++a)
        if (values[a] > 1e-6 * values[2] && values[2] > 0) inverse[a] = 1 / values[a];
    const Eigen::Matrix3d G =
        solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose();
    return {static_cast<float>(G(0, 0)), static_cast<float>(G(0, 1)), static_cast<float>(G(0, 2)),
            static_cast<float>(G(1, 1)), static_cast<float>(G(1, 2)), static_cast<float>(G(2, 2))};
}

/// A box around points, axis-aligned or along their principal axes, whichever has the shorter sides.
void set_rest_box(RestBoxes& boxes, int lane, std::span<const Eigen::Vector3d> points) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& p : points) spread += (p - mean) * (p - mean).transpose();
    const Eigen::Matrix3d principal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
    double shortest = std::numeric_limits<double>::infinity();
    for (const Eigen::Matrix3d& axes : {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), principal}) {
        Eigen::Array3d lo = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity()), hi = -lo;
        for (const Eigen::Vector3d& p : points) {
            const Eigen::Array3d along = (axes.transpose() * p).array();
            lo = lo.min(along);
            hi = hi.max(along);
        }
        if (!((hi - lo).sum() < shortest)) continue;
        shortest = (hi - lo).sum();
        const Eigen::Vector3d centre = axes * ((lo + hi) / 2).matrix();
        // Sums in double precision are off by far less than the length added here.
        const Eigen::Array3d half = (hi - lo) / 2 + 1e-6;
        int thin;
        half.minCoeff(&thin);
        for (int a = 0; a < 3; ++a) {
            boxes.centre[a][lane] = static_cast<float>(centre[a]);
            for (int side = 0; side < 3; ++side) {
                const int axis = (thin + 1 + side) % 3;
                boxes.side[side][a][lane] = static_cast<float>(axes(a, axis) * half[axis]);
            }
        }
    }
}

/// Raises `reach` to what a box of the rest pose needs.
void reach_box(const RestBoxes& boxes, int lane, Eigen::Vector3d& reach) {
    for (int a = 0; a < 3; ++a) {
        double far = std::abs(double{boxes.centre[a][lane]});
        for (int side = 0; side < 3; ++side) far += std::abs(double{boxes.side[side][a][lane]});
        reach[a] = std::max(reach[a], far);
    }
}

float rounded_up(double x) {
    return std::nextafter(static_cast<float>(x), std::numeric_limits<float>::infinity());
}

}  // namespace

NodeLists::NodeLists(std::span<const std::span<const std::int32_t>> lists, int node_count)
    : last_(3 * (node_count - 1)) {
    for (const auto& list : lists) {
        const std::size_t begin = places_.size();
        for (const std::int32_t place : list)
            if (place == last_)
                at_end_.push_back(counts_.size());
            else
                places_.push_back(place);
        while ((places_.size() - begin) % 4 != 0) places_.push_back(places_.back());
        counts_.push_back(static_cast<std::int32_t>(places_.size() - begin));
    }
}

bool NodeLists::boxes(const float* x, std::span<Box> boxes) const noexcept {
    bool finite =
        kernels().boxes_of_lists(x, places_.data(), counts_.data(), counts_.size(), numbers(boxes.front()));
    const float* p = x + last_;
    for (const int list : at_end_) {
        const Eigen::Array4f point(p[0], p[1], p[2], 0);
        finite &= (0 * point == 0).all();
        Box& box = boxes[list];
        box = joined(box, {point, point});
    }
    return finite;
}

std::size_t NodeLists::bytes() const noexcept {
    return (places_.size() + counts_.size()) * sizeof(places_[0]) + at_end_.size() * sizeof(at_end_[0]);
}

std::vector<int> distinct(std::span<const std::vector<int>> lists) {
    std::vector<int> all;
    for (const std::vector<int>& list : lists) all.insert(all.end(), list.begin(), list.end());
    std::ranges::sort(all);
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
}

void AffineParts::add_map(const Children& children, const Children& carriers, const SurfaceEmbedding& W,
                          VerticesRef rest) {
    node_count_ = W.cols();
    add_fitted(carriers, distinct(carriers), rest, [&](std::size_t k, const Frame& frame) {
        std::vector<Eigen::Vector3d> points;
        for (const int v : children[k]) points.push_back(frame.of_vertex(v, W));
        return points;
    });
}

void AffineParts::add_map(const Children& children, const Children& carriers, std::span<const int> samples,
                          VerticesRef X) {
    node_count_ = X.rows();
    add_fitted(carriers, {samples.begin(), samples.end()}, X, [&](std::size_t k, const Frame& frame) {
        std::vector<Eigen::Vector3d> points;
        for (const int v : children[k]) points.push_back(frame.of_point(X.row(v)));
        return points;
    });
}

template <class RestPoints>
void AffineParts::add_fitted(const Children& carriers, std::vector<int> nodes, VerticesRef rest,
                             const RestPoints& rest_points) {
    assert(!nodes.empty());
    add_nodes(nodes);
    for (std::size_t c = 0, most = longest(carriers); c < most; ++c)
        for (const std::vector<int>& list : carriers)
            carriers_.push_back(static_cast<std::uint16_t>(
                std::ranges::lower_bound(nodes, entry(list, c, nodes.front())) - nodes.begin()));
    while (nodes.size() % lanes != 0) {
        nodes.push_back(nodes.back());
        nodes_.push_back(nodes_.back());
    }
    max_nodes_ = std::max(max_nodes_, static_cast<int>(nodes.size()));

    const Frame frame(nodes, rest);
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    Eigen::Vector3d reach = Eigen::Vector3d::Zero();
    std::vector<Eigen::Vector3d> r;
    for (const int node : nodes) {
        r.push_back(frame.of_node(node));
        sum += r.back() * r.back().transpose();
        reach = reach.cwiseMax(r.back().cwiseAbs());
    }
    for (int a = 0; a < 3; ++a)
        for (const Eigen::Vector3d& p : r) rest_.push_back(static_cast<std::int16_t>(p[a]));
    RestBoxes& boxes = boxes_.emplace_back();
    for (std::size_t k = 0; k < lanes; ++k)
        if (!carriers[k].empty()) {
            set_rest_box(boxes, k, rest_points(k, frame));
            reach_box(boxes, k, reach);
        }
    for (const float number : inverse_moments(sum)) numbers_.push_back(number);
    for (int a = 0; a < 3; ++a) numbers_.push_back(rounded_up(reach[a]));
    end_part(ChildBounds::map);
}

void AffineParts::add_around_nodes(const Children& carriers, ChildBounds bounds) {
    assert(bounds != ChildBounds::map);
    const std::vector<int> nodes = distinct(carriers);
    add_nodes(nodes);
    const std::size_t listed = bounds == ChildBounds::nodes ? longest(carriers) : 0;
    for (std::size_t c = 0; c < listed; ++c)
        for (const std::vector<int>& list : carriers)
            child_nodes_.push_back(3 * entry(list, c, nodes.front()));
    end_part(bounds);
}

void AffineParts::add_nodes(std::span<const int> nodes) {
    places_.back().node_count = nodes.size();
    for (const int node : nodes) nodes_.push_back(3 * node);
}

void AffineParts::end_part(ChildBounds bounds) {
    bounds_.push_back(bounds);
    places_.push_back({.nodes = nodes_.size(),
                       .node_count = 0,
                       .child_nodes = child_nodes_.size(),
                       .carriers = carriers_.size(),
                       .rest = rest_.size(),
                       .numbers = numbers_.size(),
                       .boxes = boxes_.size()});
}

AffinePart AffineParts::part(int i) const noexcept {
    const Place &p = places_[i], &next = places_[static_cast<std::size_t>(i) + 1];
    if (child_bounds(i) != ChildBounds::map) return {};
    const float* moments = numbers_.data() + p.numbers;
    return {.nodes = nodes_.data() + p.nodes,
            .count = static_cast<int>(next.nodes - p.nodes),
            .at_end = nodes_[next.nodes - 1] == 3 * (node_count_ - 1),
            .carrier = carriers_.data() + p.carriers,
            .carriers = static_cast<int>((next.carriers - p.carriers) / lanes),
            .rest = rest_.data() + p.rest,
            .moments = moments,
            .reach = moments + 6};
}

void AffineParts::prefetch(int part) const noexcept {
    const Place &p = places_[part], &next = places_[static_cast<std::size_t>(part) + 1];
    const auto prefetch_range = [](const auto& array, std::size_t begin, std::size_t end) {
        prefetch_lines(std::span(array).subspan(begin, end - begin));
    };
    prefetch_range(nodes_, p.nodes, next.nodes);
    prefetch_range(child_nodes_, p.child_nodes, next.child_nodes);
    prefetch_range(carriers_, p.carriers, next.carriers);
    prefetch_range(boxes_, p.boxes, next.boxes);
    prefetch_range(rest_, p.rest, next.rest);
    prefetch_range(numbers_, p.numbers, next.numbers);
}

std::size_t AffineParts::bytes() const noexcept {
    const auto size = [](const auto&... arrays) { return ((arrays.size() * sizeof(arrays[0])) + ...); };
    return size(places_, bounds_, nodes_, child_nodes_, carriers_, rest_, numbers_, boxes_);
}

}  // namespace nbd

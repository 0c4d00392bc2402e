#include "collision/neighbours/edge_paths.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

namespace nbd {
namespace {

constexpr double unreached = std::numeric_limits<double>::infinity();

std::vector<std::pair<int, int>> edge_ends(FacesRef F) {
    std::vector<std::pair<int, int>> ends;
    ends.reserve(6 * F.rows());
    for (int f = 0; f < F.rows(); ++f)
        for (int k = 0; k < 3; ++k) {
            const int a = F(f, k), b = F(f, (k + 1) % 3);
            if (a == b) continue;
            ends.emplace_back(a, b);
            ends.emplace_back(b, a);
        }
    return ends;
}

std::vector<std::pair<int, int>> face_corners(FacesRef F) {
    std::vector<std::pair<int, int>> corners;
    corners.reserve(3 * F.rows());
    for (int f = 0; f < F.rows(); ++f)
        for (int k = 0; k < 3; ++k) corners.emplace_back(F(f, k), f);
    return corners;
}

}  // namespace

EdgeGraph::Lists::Lists(std::vector<std::pair<int, int>> ends, int vertex_count) {
    std::ranges::sort(ends);
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    begin.assign(static_cast<std::size_t>(vertex_count) + 1, 0);
    items.reserve(ends.size());
    for (const auto& [vertex, item] : ends) {
        ++begin[static_cast<std::size_t>(vertex) + 1];
        items.push_back(item);
    }
    for (std::size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
}

EdgeGraph::EdgeGraph(FacesRef F, int vertex_count)
    : vertices_(edge_ends(F), vertex_count), faces_(face_corners(F), vertex_count) {}

EdgePaths::EdgePaths(const EdgeGraph& graph, const Nodes& X)
    : graph_(graph), X_(X), lengths_(X.rows(), unreached), is_taken_(X.rows(), 0) {}

void EdgePaths::push(double length, int vertex) {
    lengths_[vertex] = length;
    touched_.push_back(vertex);
    heap_.push_back({length, vertex});
    std::ranges::push_heap(heap_, std::greater{});
}

EdgePaths::Reached EdgePaths::pop() {
    std::ranges::pop_heap(heap_, std::greater{});
    const Reached least = heap_.back();
    heap_.pop_back();
    return least;
}

void EdgePaths::grow(std::vector<int>& vertices, double radius, std::size_t most) {
    heap_.clear();
    touched_.clear();
    for (const int v : vertices) {
        is_taken_[v] = 1;
        push(0, v);
    }
    while (!heap_.empty() && vertices.size() < most) {
        const auto [length, vertex] = pop();
        if (length > lengths_[vertex]) continue;
        if (std::exchange(is_taken_[vertex], 1) == 0) vertices.push_back(vertex);
        for (const int other : graph_.neighbours(vertex)) {
            const double through = length + (X_.row(vertex) - X_.row(other)).norm();
            if (through <= radius && through < lengths_[other]) push(through, other);
        }
    }
    for (const int v : touched_) {
        lengths_[v] = unreached;
        is_taken_[v] = 0;
    }
}

}  // namespace nbd

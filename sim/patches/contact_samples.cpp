#include "sim/patches/contact_samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "sim/patches/surface_normals.hpp"

namespace nbd {
namespace {

constexpr std::int64_t least_per_node = 12;
constexpr double least_per_cell = 16, cells_per_node = 4;
constexpr std::size_t kept_per_cell = 3;

/// The sum of the normals of each vertex's faces.
Nodes vertex_normals(const Faces& F, const Nodes& rest) {
    Nodes normals = Nodes::Zero(rest.rows(), 3);
    for (int face = 0; face < F.rows(); ++face) {
        const Eigen::RowVector3d normal = face_normal(F, rest, face);
        for (const int corner : F.row(face)) normals.row(corner) += normal;
    }
    return normals;
}

/// The cell of a vertex, and which of the six directions along the axes it faces most.
using Place = std::array<std::int64_t, 4>;

Place place_of(const Eigen::RowVector3d& x, const Eigen::RowVector3d& normal, double cell) {
    Eigen::Index axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    const auto index = [&](Eigen::Index i) { return static_cast<std::int64_t>(std::floor(x[i] / cell)); };
    return {index(0), index(1), index(2), 2 * axis + (normal[axis] < 0)};
}

/// The vertices of a group that are kept.
std::vector<int> most_spread(std::span<const int> group, const Nodes& rest, const Nodes& normals) {
    Eigen::RowVector3d outward = Eigen::RowVector3d::Zero();
    for (const int vertex : group) outward += normals.row(vertex);
    std::vector<int> kept;
    std::vector<double> distances(group.size(), std::numeric_limits<double>::infinity());
    std::size_t next = 0;
    for (std::size_t k = 1; k < group.size(); ++k)
        if (rest.row(group[k]).dot(outward) > rest.row(group[next]).dot(outward)) next = k;
    while (kept.size() < kept_per_cell && distances[next] > 0) {
        kept.push_back(group[next]);
        for (std::size_t k = 0; k < group.size(); ++k)
            distances[k] = std::min(distances[k], (rest.row(group[k]) - rest.row(kept.back())).squaredNorm());
        next = std::ranges::max_element(distances) - distances.begin();
    }
    return kept;
}

}  // namespace

ContactSamples contact_samples(const Faces& F, const Nodes& rest, const Eigen::VectorXd& rest_areas,
                               int carriers) {
    const std::size_t count = rest.rows();
    const double per_node = static_cast<double>(rest.rows()) / std::max(carriers, 1),
                 per_cell = std::max(least_per_cell, per_node / cells_per_node),
                 cell = std::sqrt(per_cell * rest_areas.mean());
    if (rest.rows() < least_per_node * carriers || !(cell > 0))
        return {std::vector<bool>(count, true), rest_areas};
    ContactSamples samples{std::vector<bool>(count, false), Eigen::VectorXd::Zero(rest.rows())};
    const Nodes normals = vertex_normals(F, rest);
    const Eigen::RowVector3d corner = rest.colwise().minCoeff();
    std::vector<Place> places(count);
    for (Eigen::Index v = 0; v < rest.rows(); ++v)
        places[v] = place_of(rest.row(v) - corner, normals.row(v), cell);
    std::vector<int> order;
    for (Eigen::Index v = 0; v < rest.rows(); ++v)
        if (rest_areas[v] > 0) order.push_back(v);
    const auto place = [&](int vertex) -> const Place& { return places[vertex]; };
    std::ranges::sort(order,
                      [&](int a, int b) { return place(a) != place(b) ? place(a) < place(b) : a < b; });
    for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
        while (end < order.size() && place(order[end]) == place(order[begin])) ++end;
        const auto group = std::span(order).subspan(begin, end - begin);
        const std::vector<int> kept = most_spread(group, rest, normals);
        for (const int vertex : kept) samples.kept[vertex] = true;
        for (const int vertex : group)
            samples.areas[*std::ranges::min_element(kept, {}, [&](int sample) {
                return (rest.row(sample) - rest.row(vertex)).squaredNorm();
            })] += rest_areas[vertex];
    }
    return samples;
}

}  // namespace nbd

#include "meshing/cage/cage.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

#include "collision/base/stop.hpp"
#include "meshing/surface/edges.hpp"
#include "meshing/surface/subdivide.hpp"

namespace nbd {
namespace {

/// A regular grid of points over a box, to compare the insides of two closed surfaces.
class ChamberGrid {
 public:
    explicit ChamberGrid(const Eigen::AlignedBox3d& box);

    /// The chambers of `coarse` are its inside farther than `depth` from the soup. Returns the share of them
    /// that `fine` leaves out; 0 if they are less than a twentieth of the inside.
    double share_lost(const TriMesh& coarse, const TriMesh& fine, const AlphaWrap& soup, double depth) const;

 private:
    static constexpr int side = 40;  // points along each axis
    std::vector<char> inside(const TriMesh& surface) const;
    Eigen::Vector3d point(int i, int j, int k) const;
    Eigen::Vector3d corner_, step_;
};

std::size_t index(int side, int i, int j, int k) { return (i * side + j) * side + k; }

ChamberGrid::ChamberGrid(const Eigen::AlignedBox3d& box)
    : corner_(box.min()), step_((box.sizes() / side).cwiseMax(1e-9 * box.diagonal().norm())) {
    // Uneven shifts keep the columns off the edges of axis-aligned shapes.
    corner_ += step_.cwiseProduct(Eigen::Vector3d(0.5123, 0.4871, 0.5));
}

Eigen::Vector3d ChamberGrid::point(int i, int j, int k) const {
    return corner_ + step_.cwiseProduct(Eigen::Vector3d(i, j, k));
}

/// Counts the crossings of each column of points with the surface.
std::vector<char> ChamberGrid::inside(const TriMesh& surface) const {
    std::vector<std::vector<double>> heights(static_cast<std::size_t>(side) * side);
    for (int f = 0; f < surface.F.rows(); ++f) {
        Eigen::Matrix3d corners;  // columns; in steps from the grid's corner
        for (int c = 0; c < 3; ++c)
            corners.col(c) = (surface.X.row(surface.F(f, c)).transpose() - corner_).cwiseQuotient(step_);
        const Eigen::Vector3d a = corners.col(0), b = corners.col(1), c = corners.col(2);
        const Eigen::Vector3d low = corners.rowwise().minCoeff(), high = corners.rowwise().maxCoeff();
        const double doubled = (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
        if (doubled == 0) continue;
        const auto first = [](double x) { return std::max(0, static_cast<int>(std::ceil(x))); };
        const auto last = [](double x) { return std::min(side - 1, static_cast<int>(std::floor(x))); };
        for (int i = first(low.x()); i <= last(high.x()); ++i)
            for (int j = first(low.y()); j <= last(high.y()); ++j) {
                const auto side_of = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
                    return ((q.x() - p.x()) * (j - p.y()) - (q.y() - p.y()) * (i - p.x())) / doubled;
                };
                const double wa = side_of(b, c), wb = side_of(c, a), wc = side_of(a, b);
                if (wa < 0 || wb < 0 || wc < 0) continue;
                heights[i * side + j].push_back(wa * a.z() + wb * b.z() + wc * c.z());
            }
    }
    std::vector<char> result(static_cast<std::size_t>(side) * side * side, 0);
    for (int i = 0; i < side; ++i)
        for (int j = 0; j < side; ++j) {
            std::vector<double>& column = heights[i * side + j];
            std::ranges::sort(column);
            std::size_t below = 0;
            for (int k = 0; k < side; ++k) {
                while (below < column.size() && column[below] < k) ++below;
                result[index(side, i, j, k)] = below % 2 == 1;
            }
        }
    return result;
}

double ChamberGrid::share_lost(const TriMesh& coarse, const TriMesh& fine, const AlphaWrap& soup,
                               double depth) const {
    const std::vector<char> before = inside(coarse), after = inside(fine);
    double all = 0, chambers = 0, lost = 0;
    for (int i = 0; i < side; ++i)
        for (int j = 0; j < side; ++j)
            for (int k = 0; k < side; ++k) {
                const std::size_t p = index(side, i, j, k);
                if (!before[p]) continue;
                ++all;
                if (!(soup.distance(point(i, j, k)) > depth)) continue;
                ++chambers;
                lost += !after[p];
            }
    return chambers >= all / 20 && chambers > 0 ? lost / chambers : 0;
}

}  // namespace

double share_lost(const TriMesh& coarse, const TriMesh& fine, const AlphaWrap& soup, double depth) {
    return ChamberGrid(soup.box()).share_lost(coarse, fine, soup, depth);
}

namespace {

/// Sizes of a closed surface that decide how many nodes fill it.
struct Size {
    double vertices = 0, area = 0, volume = 0;

    /// Expected number of tet nodes if the surface had `ratio` times as long edges. An equilateral surface of
    /// edge length h has area / (0.87 h^2) vertices; the inner nodes are what a slight grading gives.
    double nodes(double ratio = 1) const {
        const double at_ratio = vertices / (ratio * ratio), edge = std::sqrt(area / (0.87 * at_ratio));
        return at_ratio + 0.35 * std::max(0., volume - 0.4 * area * edge) / (edge * edge * edge);
    }

    /// The ratio of edge lengths that gives `wanted` nodes.
    double ratio_for(double wanted) const {
        double low = 1e-3, high = 1e3;
        for (int i = 0; i < 60; ++i) {
            const double middle = std::sqrt(low * high);
            (nodes(middle) > wanted ? low : high) = middle;
        }
        return low;
    }
};

Size measure(const TriMesh& surface) {
    Size size;
    size.vertices = surface.X.rows();
    const Eigen::RowVector3d origin = surface.X.row(0);
    for (int f = 0; f < surface.F.rows(); ++f) {
        const Eigen::RowVector3d a = surface.X.row(surface.F(f, 0)) - origin,
                                 b = surface.X.row(surface.F(f, 1)) - origin,
                                 c = surface.X.row(surface.F(f, 2)) - origin;
        size.area += (b - a).cross(c - a).norm() / 2;
        size.volume += a.dot(b.cross(c)) / 6;
    }
    return size;
}

int count_parts(TriMesh surface) { return make_orientations_agree(surface.F, edge_table(surface.F)).count; }

struct Wrap {
    TriMesh surface;
    double alpha = 0;
    Size size;
    int parts = 0;
};

class CageSearch {
 public:
    CageSearch(const AlphaWrap& soup, const CageConfig& config)
        : soup_(soup), config_(config), coarsest_(soup.box().diagonal().norm() / 2) {}

    Cage find() {
        Wrap best = first_wrap();
        for (int tries = 0; tries < max_tries && !suits(best); ++tries) {
            const double alpha = next_alpha(best);
            if (alpha == 0) break;
            Wrap next = wrap(alpha);
            if (alpha < best.alpha && (next.parts > 1 || loses_inside(best, next))) {
                (next.parts > 1 ? cage_.joins_parts : cage_.closes_holes) = true;
                too_fine_ = alpha;
            } else {
                best = std::move(next);
            }
        }
        return finish(std::move(best));
    }

 private:
    static constexpr int max_tries = 12;

    Wrap wrap(double alpha) const {
        stop_if_asked();
        Wrap result{soup_.wrap(alpha, config_.offset_share * alpha), alpha, {}, 0};
        result.size = measure(result.surface);
        result.parts = count_parts(result.surface);
        return result;
    }

    /// Coarse enough for a box around the soup and to close its holes, and then until it is one part.
    Wrap first_wrap() {
        const Eigen::Vector3d side = soup_.box().sizes();
        Size box{1, 2 * (side.x() * side.y() + side.y() * side.z() + side.z() * side.x()), side.prod()};
        box.vertices = box.area / (0.87 * coarsest_ * coarsest_);
        double alpha = std::clamp(coarsest_ * box.ratio_for(config_.nodes), coarsest_ / 5, coarsest_);
        for (;;) {
            Wrap result = wrap(alpha);
            if (result.parts == 1) return result;
            cage_.joins_parts = true;
            too_fine_ = alpha;
            if (alpha == coarsest_)
                throw std::invalid_argument(
                    fmt::format("the surface falls into {} parts that lie too far apart for one cage; "
                                "allowed: parts that touch or nearly touch",
                                result.parts));
            alpha = std::min(1.5 * alpha, coarsest_);
        }
    }

    bool suits(const Wrap& wrap) const {
        const double nodes = wrap.size.nodes();
        return nodes > 0.85 * config_.nodes && nodes < 1.1 * config_.nodes;
    }

    /// The next alpha to try; 0 if the search cannot improve on `best`.
    double next_alpha(const Wrap& best) const {
        const double wanted = best.alpha * best.size.ratio_for(config_.nodes);
        // Halving at most, so that each step loses the inside only through holes that the step before closed.
        const double alpha = std::clamp(wanted, best.alpha / 2, coarsest_);
        if (alpha > best.alpha) return best.alpha < coarsest_ ? alpha : 0;
        if (alpha > too_fine_) return alpha;
        const double between = std::sqrt(too_fine_ * best.alpha);
        return between < 0.85 * best.alpha ? between : 0;
    }

    /// Whether `fine` leaves out most of what lies deep inside `coarse`: a ball of the coarse alpha fits
    /// there, but did not get in.
    bool loses_inside(const Wrap& coarse, const Wrap& fine) const {
        return share_lost(coarse.surface, fine.surface, soup_, coarse.alpha) > 0.5;
    }

    Cage finish(Wrap best) {
        const double nodes = best.size.nodes();
        if (nodes > 1.3 * config_.nodes)
            throw std::invalid_argument(
                fmt::format("{} nodes cannot hold the surface; allowed: about {:.0f} or more", config_.nodes,
                            std::ceil(nodes / 10) * 10));
        if (nodes < 0.85 * config_.nodes) {
            const double ratio = best.size.ratio_for(config_.nodes);
            const int vertices = best.size.vertices / (ratio * ratio);
            best.surface = divide_longest_edges(best.surface, vertices);
        }
        cage_.alpha = best.alpha;
        cage_.offset = config_.offset_share * best.alpha;
        cage_.distance = greatest_distance(best.surface);
        cage_.surface = std::move(best.surface);
        return std::move(cage_);
    }

    double greatest_distance(const TriMesh& surface) const {
        double distance = 0;
        for (int v = 0; v < surface.X.rows(); ++v)
            distance = std::max(distance, soup_.distance(surface.X.row(v)));
        for (int f = 0; f < surface.F.rows(); ++f)
            distance = std::max(
                distance, soup_.distance((surface.X.row(surface.F(f, 0)) + surface.X.row(surface.F(f, 1)) +
                                          surface.X.row(surface.F(f, 2))) /
                                         3));
        return distance;
    }

    const AlphaWrap& soup_;
    const CageConfig config_;
    const double coarsest_;  // greatest alpha
    double too_fine_ = 0;    // greatest alpha that lost the inside or fell into parts
    Cage cage_;
};

}  // namespace

Cage find_cage(const AlphaWrap& soup, const CageConfig& config) {
    if (config.nodes < min_cage_nodes || config.nodes > max_cage_nodes)
        throw std::invalid_argument(fmt::format("a cage of {} nodes; allowed: {} to {}", config.nodes,
                                                min_cage_nodes, max_cage_nodes));
    if (!(config.offset_share > 0 && config.offset_share <= 1))
        throw std::invalid_argument(
            fmt::format("the offset is {} alpha; allowed: more than 0, at most 1", config.offset_share));
    return CageSearch(soup, config).find();
}

}  // namespace nbd

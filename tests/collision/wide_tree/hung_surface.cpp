#include "tests/collision/wide_tree/hung_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace nbd::test {

namespace {

struct Lattice {
    int cells;
    Eigen::RowVector3f lo, size;

    Lattice(const Vertices& X, int cells_per_side)
        : cells(cells_per_side),
          lo(X.colwise().minCoeff().array() - 0.01f),
          size((X.colwise().maxCoeff().array() + 0.01f).matrix() - lo) {}
    int side() const { return cells + 1; }
    Vertices nodes() const {
        Vertices rest(side() * side() * side(), 3);
        for (int i = 0; i < rest.rows(); ++i) {
            const Eigen::Array3f place(static_cast<float>(i % side()),
                                       static_cast<float>(i / side() % side()),
                                       static_cast<float>(i / side() / side()));
            rest.row(i) = lo.array() + size.array() * place.transpose() / static_cast<float>(cells);
        }
        return rest;
    }
    int node(const Eigen::Array3i& place) const { return place[0] + side() * (place[1] + side() * place[2]); }
};

/// weights: adds the weights of a vertex, from its cell and its place in the cell, 0 to 1.
template <class Weights>
HungSurface hung(const shapes::Surface& surface, int cells, const Weights& weights) {
    const Lattice lattice(surface.X, cells);
    HungSurface result{surface, {}, lattice.nodes()};
    std::vector<Eigen::Triplet<float>> entries;
    for (int v = 0; v < surface.X.rows(); ++v) {
        const Eigen::Array3f at =
            ((surface.X.row(v) - lattice.lo).array() / lattice.size.array() * static_cast<float>(cells))
                .transpose();
        const Eigen::Array3i cell = at.cast<int>().min(cells - 1);
        weights(cell, Eigen::Array3f(at - cell.cast<float>()),
                [&](const Eigen::Array3i& place, float weight) {
                    entries.emplace_back(v, lattice.node(place), std::max(weight, 0.f));
                });
    }
    result.W.resize(surface.X.rows(), result.rest.rows());
    result.W.setFromTriplets(entries.begin(), entries.end());
    apply_embedding(result.W, result.rest, result.surface.X);
    return result;
}

}  // namespace

HungSurface hung_on_lattice(const shapes::Surface& surface, int cells) {
    return hung(surface, cells, [](const Eigen::Array3i& cell, const Eigen::Array3f& f, const auto& add) {
        for (int corner = 0; corner < 8; ++corner) {
            const Eigen::Array3i up(corner & 1, corner >> 1 & 1, corner >> 2);
            float weight = 1;
            for (int a = 0; a < 3; ++a) weight *= up[a] ? f[a] : 1 - f[a];
            add(cell + up, weight);
        }
    });
}

HungSurface hung_on_tets(const shapes::Surface& surface, int cells) {
    return hung(surface, cells, [](const Eigen::Array3i& cell, const Eigen::Array3f& f, const auto& add) {
        // Kuhn's division: steps along the axes in descending order of the coordinates.
        std::array<int, 3> axes{0, 1, 2};
        std::ranges::sort(axes, [&](int a, int b) { return f[a] > f[b]; });
        Eigen::Array3i place = cell;
        add(place, 1 - f[axes[0]]);
        for (std::size_t k = 0; k < 3; ++k) {
            ++place[axes[k]];
            add(place, f[axes[k]] - (k < 2 ? f[axes[k + 1]] : 0));
        }
    });
}

HungSurface hung_on_itself(const shapes::Surface& surface) {
    HungSurface hung{surface, SurfaceEmbedding(surface.X.rows(), surface.X.rows()), surface.X};
    hung.W.setIdentity();
    return hung;
}

std::shared_ptr<const CollisionTree> hung_tree(const HungSurface& hung, const SphereTreeConfig& config) {
    CollisionTree tree = make_exact_tree(hung.surface.X, hung.surface.F, config);
    hang_on_nodes(tree, hung.W, hung.rest);
    return std::make_shared<const CollisionTree>(std::move(tree));
}

Vertices wild_pose(const Vertices& rest, int kind, std::mt19937& random) {
    Vertices x = shapes::wobbled(rest, random, 0.05f);
    switch (kind % wild_poses) {
        case 0:  // twisted about z
            for (int i = 0; i < x.rows(); ++i) {
                const float angle = 4 * x(i, 2), c = std::cos(angle), s = std::sin(angle);
                const Eigen::RowVector3f p = x.row(i);
                x.row(i) << c * p[0] - s * p[1], s * p[0] + c * p[1], p[2];
            }
            break;
        case 1:  // crushed
            x.col(1) *= 1e-4f;
            break;
        case 2:  // inside out
            x.col(0) *= -1;
            break;
        case 3:  // scattered
            for (int i = 0; i < x.rows(); ++i) x.row(i) += 0.3f * shapes::uniform3(random).transpose();
            break;
        case 4:  // far away, with few digits left
            x.rowwise() += Eigen::RowVector3f(9000, -7000, 4000);
            break;
        case 5:  // tiny
            x *= 1e-6f;
            break;
        default:
            break;
    }
    return x;
}

}  // namespace nbd::test

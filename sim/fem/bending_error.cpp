#include "sim/fem/bending_error.hpp"

#include <Eigen/Dense>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "meshing/body/embed.hpp"
#include "meshing/surface/material_fill.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/factor/cholesky.hpp"
#include "sim/fem/elastic_body.hpp"

namespace nbd {
namespace {

/// The values at the nodes of quadratic tetrahedra of functions that other ones on the same shape have:
/// those on each edge follow from the one in its middle. [N of finer, N of coarse].
Eigen::SparseMatrix<double> values_in(const TetMesh& finer, const TetMesh& coarse) {
    const Embedding at = embed(coarse, finer.X);
    std::vector<Eigen::Triplet<double>> entries;
    const auto add = [&](int node, int of, double weight) {
        for (Embedding::InnerIterator entry(at, of); entry; ++entry)
            entries.emplace_back(node, entry.col(), weight * entry.value());
    };
    std::vector<char> is_known(finer.X.rows(), 0);
    for (Eigen::Index t = 0; t < finer.T.rows(); ++t) {
        for (const int node : finer.T.row(t))
            if (!std::exchange(is_known[node], 1)) add(node, node, 1);
        for (std::size_t k = 0; k < edges_of_tet.size(); ++k) {
            const int node = finer.E(t, k);
            if (std::exchange(is_known[node], 1)) continue;
            add(node, node, 2);
            add(node, finer.T(t, edges_of_tet[k].first), -0.5);
            add(node, finer.T(t, edges_of_tet[k].second), -0.5);
        }
    }
    Eigen::SparseMatrix<double> result(finer.X.rows(), coarse.X.rows());
    result.setFromTriplets(entries.begin(), entries.end());
    return result;
}

/// What fills tetrahedra, from what fills their eight parts.
TetFill fill_of_parts(const TetMesh& whole, const TetMesh& parts) {
    TetFill fill = TetFill::Zero(whole.T.rows(), 10);
    for (Eigen::Index p = 0; p < parts.T.rows(); ++p) {
        const Eigen::Index t = p / 8;
        Eigen::Matrix4d corners = Eigen::Matrix4d::Ones(), own = corners;  // places, and ones
        for (int a = 0; a < 4; ++a) {
            corners.col(a).head<3>() = (whole.X.row(whole.T(t, a)) - whole.X.row(whole.T(t, 0))).transpose();
            own.col(a).head<3>() = (parts.X.row(parts.T(p, a)) - whole.X.row(whole.T(t, 0))).transpose();
        }
        const Eigen::Matrix4d z = corners.inverse() * own;  // coordinates of the part's corners
        fill.row(t) += fill_of_products(z * coordinate_products(parts.fill.row(p)) * z.transpose() / 8);
    }
    return fill;
}

/// Forces that bend a body and neither move nor turn it: along its shortest axis of inertia, and growing with
/// the square of the way along the longest.
class Bending {
 public:
    explicit Bending(const ElasticBody& body) : body_(body), a_(Nodes::Zero(body.node_count(), 3)) {
        const Nodes& X = body.rest().X;
        const Eigen::RowVector3d centre = body.node_masses().transpose() * X / body.mass();
        const Nodes arm = X.rowwise() - centre;
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(arm.transpose() * body.mass_product(arm));
        const Eigen::RowVector3d shortest = axes.eigenvectors().col(0).transpose();
        const Eigen::VectorXd along = arm * axes.eigenvectors().col(2);
        for (int i = 0; i < body.node_count(); ++i) a_.row(i) = along[i] * along[i] * shortest;
        const TetMesh& tets = body.rest();
        for (Eigen::Index t = 0; t < tets.E.rows(); ++t)
            for (std::size_t k = 0; k < edges_of_tet.size(); ++k) {
                const auto [a, b] = edges_of_tet[k];
                a_.row(tets.E(t, k)) = along[tets.T(t, a)] * along[tets.T(t, b)] * shortest;
            }
        Eigen::MatrixXd rigid = Eigen::MatrixXd::Zero(3 * body.node_count(), 6);
        for (int i = 0; i < body.node_count(); ++i)
            for (int k = 0; k < 3; ++k) {
                rigid(3 * i + k, k) = 1;
                rigid.block<3, 1>(3 * i, 3 + k) =
                    Eigen::Vector3d::Unit(k).cross(Eigen::Vector3d(arm.row(i).transpose()));
            }
        Eigen::MatrixXd moved(3 * body.node_count(), 6);
        for (int k = 0; k < 6; ++k) moved.col(k) = stacked(body.mass_product(unstacked(rigid.col(k))));
        Eigen::VectorXd a = stacked(a_);
        a -= rigid * (rigid.transpose() * moved).ldlt().solve(moved.transpose() * a);
        a_ = unstacked(a);
    }

    Nodes forces() const { return body_.mass_product(a_); }

    static Eigen::VectorXd stacked(const Nodes& x) { return x.reshaped<Eigen::RowMajor>(); }
    static Nodes unstacked(const Eigen::VectorXd& x) {
        return Eigen::Map<const Nodes>(x.data(), x.size() / 3, 3);
    }
    /// a^T M a, where the forces are M a.
    double inertia() const { return a_.cwiseProduct(forces()).sum(); }
    /// The square of the angular frequency of a motion like the forces: more than the lowest one's.
    double rate(const SparseMatrix& K) const {
        const Eigen::VectorXd a = stacked(a_);
        return a.dot(K * a) / inertia();
    }

 private:
    const ElasticBody& body_;
    Nodes a_;
};

/// Work of forces that neither move nor turn a body. shift: of K by multiples of M, which makes it definite.
double work(const ElasticBody& body, const Nodes& forces, double shift) {
    SparseMatrix K = body.rest_stiffness();
    K += shift * body.mass_matrix();
    Cholesky factor;
    factor.analyze(K);
    factor.factorize(K);
    const Eigen::VectorXd f = Bending::stacked(forces);
    Eigen::VectorXd u(f.size());
    factor.solve(f, u);
    return f.dot(u);
}

}  // namespace

std::optional<double> bending_error(const Body& body, int most_tets, const TriMesh* solid) {
    const bool quadratic = body.tets.is_quadratic(), is_full = body.tets.fill.rows() == 0;
    const int parts = quadratic ? 8 : 1;
    if (parts * body.tets.T.rows() > most_tets || (quadratic && !is_full && !solid)) return {};
    TetMesh finer = make_quadratic(quadratic ? split(body.tets) : body.tets);
    TetMesh own = body.tets;
    if (quadratic && !is_full) {
        finer.fill = material_fill(finer, *solid);
        own.fill = fill_of_parts(own, finer);  // the same, so that finer ones can only yield more
    }
    std::vector<MaterialRegion> regions = body.regions;
    for (MaterialRegion& region : regions)
        if (quadratic) {
            const std::vector<int> whole = std::exchange(region.tets, {});
            for (const int t : whole)
                for (int k = 0; k < parts; ++k) region.tets.push_back(parts * t + k);
        }
    try {
        const ElasticBody coarse(std::move(own), body.material, body.regions),
            richer(std::move(finer), body.material, regions);
        const Bending bending(richer);
        const Nodes forces = bending.forces();
        constexpr double little = 1e-9, floating = 1e-2;
        const double shift = little * bending.rate(richer.rest_stiffness()),
                     most = work(richer, forces, shift),
                     least =
                         work(coarse, values_in(richer.rest(), coarse.rest()).transpose() * forces, shift);
        const double missing = (most - least) / most;
        if (!(least > 0) || !(std::abs(missing) < 1)) return {};
        if (most * shift > floating * bending.inertia()) return {};  // the shift alone holds some of it
        return std::abs(quadratic ? 4 * missing / 3 : missing);
    } catch (const std::runtime_error&) {  // too large for the factor
        return {};
    } catch (const std::invalid_argument&) {  // tetrahedra that no simulation takes
        return {};
    }
}

}  // namespace nbd

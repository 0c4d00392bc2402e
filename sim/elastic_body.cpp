#include "sim/elastic_body.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "meshing/body_check.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "sim/polar.hpp"

namespace nbd {
namespace {

// Before the pattern is built: a bad index must not get that far.
TetMesh checked(TetMesh mesh) {
    const Eigen::Index nodes = mesh.X.rows();
    if (mesh.T.rows() == 0)
        throw std::invalid_argument("elastic body: no tetrahedra, at least one is needed");
    std::vector<char> used(nodes, 0);
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
        for (int a = 0; a < 4; ++a) {
            const int node = mesh.T(t, a);
            if (node < 0 || node >= nodes)
                throw std::invalid_argument(fmt::format(
                    "tetrahedron {} refers to node {}, but the mesh has {} nodes", t, node, nodes));
            used[node] = 1;
        }
    for (Eigen::Index i = 0; i < nodes; ++i) {
        if (!mesh.X.row(i).allFinite())
            throw std::invalid_argument(fmt::format("node {} lies at ({} {} {}), positions must be finite", i,
                                                    mesh.X(i, 0), mesh.X(i, 1), mesh.X(i, 2)));
        if (!used[i]) throw std::invalid_argument(fmt::format("node {} belongs to no tetrahedron", i));
    }
    return mesh;
}

// Edge vectors from the first corner, as columns.
template <class Positions>
Eigen::Matrix3d edges(const Positions& x, const Tets& T, int t) {
    Eigen::Matrix3d D;
    for (int a = 0; a < 3; ++a) D.col(a) = (x.row(T(t, a + 1)) - x.row(T(t, 0))).transpose();
    return D;
}

}  // namespace

ElasticBody::ElasticBody(TetMesh rest, const Material& material, MassKind mass)
    : rest_(checked(std::move(rest))),
      material_(material),
      pattern_(static_cast<int>(rest_.X.rows()), rest_.T) {
    check_material(material_);
    const double E = material_.young, nu = material_.poisson;
    mu_ = E / (2 * (1 + nu));
    lambda_ = E * nu / ((1 + nu) * (1 - 2 * nu));
    measure_elements();
    list_incidences();
    build_mass(mass);
}

void ElasticBody::measure_elements() {
    volume_.resize(element_count());
    gradient_.resize(element_count());
    for (int t = 0; t < element_count(); ++t) {
        const Eigen::Matrix3d D = edges(rest_.X, rest_.T, t);
        volume_[t] = D.determinant() / 6;
        if (!(volume_[t] > 0))
            throw std::invalid_argument(
                fmt::format("tetrahedron {} has volume {} m3, it must be > 0", t, volume_[t]));
        gradient_[t].rightCols<3>() = D.inverse().transpose();
        gradient_[t].col(0) = -gradient_[t].rightCols<3>().rowwise().sum();
        if (!gradient_[t].allFinite())
            throw std::invalid_argument(fmt::format("tetrahedron {} is flat to rounding", t));
    }
}

void ElasticBody::list_incidences() {
    const auto offsets = [](std::vector<int> count) {
        std::vector<int> offset(count.size() + 1, 0);
        std::partial_sum(count.begin(), count.end(), offset.begin() + 1);
        return offset;
    };
    const Tets& T = rest_.T;
    std::vector<int> corners(node_count(), 0), pairs(pattern_.block_count(), 0);
    for (int t = 0; t < element_count(); ++t)
        for (int a = 0; a < 4; ++a) {
            ++corners[T(t, a)];
            for (int b = 0; b < 4; ++b)
                if (T(t, b) >= T(t, a)) ++pairs[pattern_.find(T(t, a), T(t, b))];
        }
    corner_offset_ = offsets(std::move(corners));
    pair_offset_ = offsets(std::move(pairs));
    corner_.resize(corner_offset_.back());
    pair_.resize(pair_offset_.back());
    std::vector<int> next_corner = corner_offset_, next_pair = pair_offset_;
    for (int t = 0; t < element_count(); ++t)
        for (int a = 0; a < 4; ++a) {
            corner_[next_corner[T(t, a)]++] = 4 * t + a;
            for (int b = 0; b < 4; ++b)
                if (T(t, b) >= T(t, a))
                    pair_[next_pair[pattern_.find(T(t, a), T(t, b))]++] = 16 * t + 4 * a + b;
        }
    mirror_.resize(pattern_.block_count());
    for (int i = 0; i < node_count(); ++i) {
        const auto row = pattern_.neighbours(i);
        for (int k = 0; k < static_cast<int>(row.size()); ++k)
            mirror_[pattern_.first_block(i) + k] = pattern_.find(row[k], i) - pattern_.first_block(row[k]);
    }
}

void ElasticBody::build_mass(MassKind kind) {
    node_mass_ = Eigen::VectorXd::Zero(node_count());
    for (int i = 0; i < node_count(); ++i)
        for (int s = corner_offset_[i]; s < corner_offset_[i + 1]; ++s)
            node_mass_[i] += material_.density * volume_[corner_[s] / 4] / 4;
    mass_ = pattern_.zero_matrix();
    for (int i = 0; i < node_count(); ++i) {
        const auto row = pattern_.neighbours(i);
        for (int k = 0; k < static_cast<int>(row.size()); ++k) {
            const int j = row[k];
            if (kind == MassKind::lumped) {
                if (j == i) pattern_.block(mass_, i, k).diagonal().setConstant(node_mass_[i]);
            } else if (j >= i) {
                const int block = pattern_.first_block(i) + k;
                double sum = 0;
                for (int s = pair_offset_[block]; s < pair_offset_[block + 1]; ++s)
                    sum += material_.density * volume_[pair_[s] / 16] / (i == j ? 10 : 20);
                pattern_.block(mass_, i, k).diagonal().setConstant(sum);
                pattern_.block(mass_, j, mirror_[block]).diagonal().setConstant(sum);
            }
        }
    }
}

void ElasticBody::pose(NodesRef x, ElementPose& pose) const {
    pose.F.resize(element_count());
    pose.R.resize(element_count());
    pose.G.resize(element_count());
    pose.f.resize(element_count());
    parallel_for(element_count(), [&](int t) {
        const Eigen::Matrix3d F = edges(x, rest_.T, t) * gradient_[t].rightCols<3>().transpose();
        const Eigen::Matrix3d R = rotation_of(F);
        const double trace = R.cwiseProduct(F).sum() - 3;
        const Eigen::Matrix3d P = 2 * mu_ * (F - R) + lambda_ * trace * R;
        pose.F[t] = F;
        pose.R[t] = R;
        pose.G[t].noalias() = R * gradient_[t];
        pose.f[t].noalias() = -volume_[t] * P * gradient_[t];
    });
}

void ElasticBody::gather(const std::vector<Corners>& corners, Eigen::Ref<Nodes> out) const {
    parallel_for(node_count(), [&](int i) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (int s = corner_offset_[i]; s < corner_offset_[i + 1]; ++s)
            sum += corners[corner_[s] / 4].col(corner_[s] % 4);
        out.row(i) = sum.transpose();
    });
}

void ElasticBody::forces(const ElementPose& pose, Eigen::Ref<Nodes> out) const { gather(pose.f, out); }

double ElasticBody::energy(const ElementPose& pose) const {
    double sum = 0;
    for (int t = 0; t < element_count(); ++t) {
        const double trace = pose.R[t].cwiseProduct(pose.F[t]).sum() - 3;
        sum += volume_[t] * (mu_ * (pose.F[t] - pose.R[t]).squaredNorm() + 0.5 * lambda_ * trace * trace);
    }
    return sum;
}

// With g the turned gradients, block (a, b) of R K_e R^T is
// V (lambda g_a g_b^T + mu g_b g_a^T + mu g_a.g_b I).
void ElasticBody::combine(double mass_scale, double stiffness_scale, const ElementPose& pose,
                          SparseMatrix& A) const {
    parallel_for(node_count(), [&](int i) {
        const auto row = pattern_.neighbours(i);
        for (int k = 0; k < static_cast<int>(row.size()); ++k) {
            const int j = row[k], block = pattern_.first_block(i) + k;
            if (j < i) continue;
            Eigen::Matrix3d outer = Eigen::Matrix3d::Zero();  // sum of V g_a g_b^T
            for (int s = pair_offset_[block]; s < pair_offset_[block + 1]; ++s) {
                const int t = pair_[s] / 16, a = pair_[s] / 4 % 4, b = pair_[s] % 4;
                outer += (volume_[t] * pose.G[t].col(a)) * pose.G[t].col(b).transpose();
            }
            // Rows of a stored block belong to j, columns to i.
            Eigen::Matrix3d K = lambda_ * outer.transpose() + mu_ * outer;
            K.diagonal().array() += mu_ * outer.trace();
            const Eigen::Matrix3d value = mass_scale * pattern_.block(mass_, i, k) + stiffness_scale * K;
            if (j == i) {
                pattern_.block(A, i, k) = 0.5 * (value + value.transpose());  // symmetric to the last bit
            } else {
                pattern_.block(A, i, k) = value;
                pattern_.block(A, j, mirror_[block]) = value.transpose();
            }
        }
    });
}

SparseMatrix ElasticBody::stiffness(const ElementPose& pose) const {
    SparseMatrix K = pattern_.zero_matrix();
    combine(0, 1, pose, K);
    return K;
}

void ElasticBody::stiffness_product(const ElementPose& pose, NodesRef u, Eigen::Ref<Nodes> out) const {
    // Corner by corner rather than through a buffer of element results: nothing to allocate, and the order
    // of sums is that of gather().
    parallel_for(node_count(), [&](int i) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (int s = corner_offset_[i]; s < corner_offset_[i + 1]; ++s) {
            const int t = corner_[s] / 4;
            const Corners& g = pose.G[t];
            Eigen::Matrix3d H = Eigen::Matrix3d::Zero();  // gradient of u in the element's turned frame
            for (int b = 0; b < 4; ++b) H += u.row(rest_.T(t, b)).transpose() * g.col(b).transpose();
            Eigen::Matrix3d stress = mu_ * (H + H.transpose());
            stress.diagonal().array() += lambda_ * H.trace();
            sum += volume_[t] * stress * g.col(corner_[s] % 4);
        }
        out.row(i) = sum.transpose();
    });
}

void ElasticBody::mass_product(NodesRef u, Eigen::Ref<Nodes> out) const {
    parallel_for(node_count(), [&](int i) {
        const auto row = pattern_.neighbours(i);
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (int k = 0; k < static_cast<int>(row.size()); ++k)
            sum += pattern_.block(mass_, i, k)(0, 0) * u.row(row[k]).transpose();  // blocks are m I
        out.row(i) = sum.transpose();
    });
}

ElementReport ElasticBody::check(const ElementPose& pose) const {
    ElementReport report;
    double smallest = std::numeric_limits<double>::infinity();
    for (int t = 0; t < element_count(); ++t) {
        const double det = pose.F[t].determinant();
        if (!std::isfinite(det)) {
            if (report.non_finite++ == 0) report.first_non_finite = t;
            continue;
        }
        smallest = std::min(smallest, det);
        if (det <= 0 && report.inverted++ == 0) report.first_inverted = t;
    }
    report.min_det = smallest;
    return report;
}

}  // namespace nbd

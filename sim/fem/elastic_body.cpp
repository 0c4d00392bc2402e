#include "sim/fem/elastic_body.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "meshing/body/body_check.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "sim/fem/polar.hpp"

namespace nbd {
namespace {

// Runs before the pattern is built, which needs valid indices.
TetMesh checked(TetMesh mesh) {
    const Eigen::Index nodes = mesh.X.rows();
    if (mesh.T.rows() == 0) throw std::invalid_argument("elastic body: no tetrahedra; allowed: at least one");
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
            throw std::invalid_argument(fmt::format("node {} lies at ({} {} {}); allowed: finite positions",
                                                    i, mesh.X(i, 0), mesh.X(i, 1), mesh.X(i, 2)));
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
    share_corner_weights();
    build_mass(mass);
}

void ElasticBody::measure_elements() {
    const int padded = (element_count() + lanes - 1) / lanes * lanes;
    volume_.resize(element_count());
    gradient_.resize(static_cast<std::size_t>(padded / lanes));
    corner_weight_.resize(4 * static_cast<std::size_t>(element_count()));
    for (int p = 0; p < padded; ++p) {
        const int t = std::min(p, element_count() - 1);
        const Eigen::Matrix3d D = edges(rest_.X, rest_.T, t);
        volume_[t] = D.determinant() / 6;
        if (!(volume_[t] > 0))
            throw std::invalid_argument(
                fmt::format("tetrahedron {} has volume {} m3; allowed: more than 0", t, volume_[t]));
        const Eigen::Matrix3d gradient = D.inverse().transpose();
        if (!gradient.allFinite())
            throw std::invalid_argument(fmt::format("tetrahedron {} is flat to rounding", t));
        gradient_[static_cast<std::size_t>(p / lanes)].set_lane(p % lanes, gradient);
        for (int a = 0; a < 4; ++a) {
            const Eigen::Vector3d g =
                a > 0 ? Eigen::Vector3d(gradient.col(a - 1)) : -gradient.rowwise().sum();
            corner_weight_[static_cast<std::size_t>(4 * t + a)] =
                static_cast<float>(volume_[t] * g.squaredNorm());
        }
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

void ElasticBody::share_corner_weights() {
    for (int i = 0; i < node_count(); ++i) {
        float total = 0;
        for (int s = corner_offset_[i]; s < corner_offset_[i + 1]; ++s) total += corner_weight_[corner_[s]];
        for (int s = corner_offset_[i]; s < corner_offset_[i + 1]; ++s) corner_weight_[corner_[s]] /= total;
    }
}

void ElasticBody::build_mass(MassKind kind) {
    node_mass_ = Eigen::VectorXd::Zero(node_count());
    for (int i = 0; i < node_count(); ++i)
        for (int s = corner_offset_[i]; s < corner_offset_[i + 1]; ++s)
            node_mass_[i] += material_.density * volume_[corner_[s] / 4] / 4;
    block_mass_.assign(static_cast<std::size_t>(pattern_.block_count()), 0);
    for (int i = 0; i < node_count(); ++i) {
        const auto row = pattern_.neighbours(i);
        for (int k = 0; k < static_cast<int>(row.size()); ++k) {
            const int j = row[k];
            if (kind == MassKind::lumped) {
                if (j == i) block_mass_[pattern_.first_block(i) + k] = node_mass_[i];
            } else if (j >= i) {
                const int block = pattern_.first_block(i) + k;
                double sum = 0;
                for (int s = pair_offset_[block]; s < pair_offset_[block + 1]; ++s)
                    sum += material_.density * volume_[pair_[s] / 16] / (i == j ? 10 : 20);
                block_mass_[block] = block_mass_[pattern_.first_block(j) + mirror_[block]] = sum;
            }
        }
    }
}

SparseMatrix ElasticBody::mass_matrix() const {
    SparseMatrix M = pattern_.zero_matrix();
    for (int i = 0; i < node_count(); ++i)
        for (int k = 0; k < static_cast<int>(pattern_.neighbours(i).size()); ++k)
            pattern_.block(M, i, k).diagonal().setConstant(block_mass_[pattern_.first_block(i) + k]);
    return M;
}

void ElasticBody::pose(NodesRef x, ElementPose& pose, RegionMeter* meter) const {
    const auto elements = static_cast<std::size_t>(element_count());
    pose.F.resize(elements);
    pose.R.resize(elements);
    pose.S.resize(elements);
    pose.f.resize(elements);
    if (meter)
        meter->reset([&](int t) -> Eigen::Matrix3d {
            return edges(x, rest_.T, t) *
                   gradient_[static_cast<std::size_t>(t / lanes)].lane(t % lanes).transpose();
        });
    parallel_for(
        static_cast<int>(gradient_.size()), [&](int batch) { pose_batch(x, batch, pose, meter); }, 64);
}

void ElasticBody::pose_batch(NodesRef x, int batch, ElementPose& pose, RegionMeter* meter) const {
    const int first = batch * lanes, count = std::min(lanes, element_count() - first);
    LaneMatrix3 D;  // edge vectors from the first corner, as columns
    Lanes volume;
    for (int l = 0; l < lanes; ++l) {
        const int t = first + std::min(l, count - 1);
        D.set_lane(l, edges(x, rest_.T, t));
        volume[l] = volume_[t];
    }
    const LaneMatrix3& g = gradient_[static_cast<std::size_t>(batch)];
    LaneMatrix3 F, R, P;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) F(i, j) = D(i, 0) * g(j, 0) + D(i, 1) * g(j, 1) + D(i, 2) * g(j, 2);
    if (meter) meter->add(first, count, F.entries);
    rotations_of(F, R);
    Lanes trace = Lanes::Constant(-3);
    for (std::size_t k = 0; k < 9; ++k) trace += R.entries[k] * F.entries[k];
    for (std::size_t k = 0; k < 9; ++k)
        P.entries[k] = -volume * (2 * mu_ * (F.entries[k] - R.entries[k]) + lambda_ * trace * R.entries[k]);
    const Lanes root = volume.sqrt();
    for (int i = 0; i < 3; ++i) {
        Lanes S[4], f[4];
        S[0] = f[0] = Lanes::Zero();
        for (int a = 0; a < 3; ++a) {
            S[a + 1] = root * (R(i, 0) * g(0, a) + R(i, 1) * g(1, a) + R(i, 2) * g(2, a));
            f[a + 1] = P(i, 0) * g(0, a) + P(i, 1) * g(1, a) + P(i, 2) * g(2, a);
            S[0] -= S[a + 1];
            f[0] -= f[a + 1];
        }
        for (int l = 0; l < count; ++l) {
            const auto t = static_cast<std::size_t>(first + l);
            for (int a = 0; a < 4; ++a) {
                pose.S[t](i, a) = S[a][l];
                pose.f[t](i, a) = f[a][l];
            }
            for (int j = 0; j < 3; ++j) {
                pose.F[t](i, j) = F(i, j)[l];
                pose.R[t](i, j) = R(i, j)[l];
            }
        }
    }
    for (int l = 0; l < count; ++l) pose.S[static_cast<std::size_t>(first + l)].row(3).setZero();
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

// s_a is column a of S: the gradient of shape function a, rotated by R, times the square root of the volume.
// Block (a, b) of R K_e R^T is lambda s_a s_b^T + mu s_b s_a^T + mu s_a.s_b I.
void ElasticBody::combine(double mass_scale, double stiffness_scale, const ElementPose& pose,
                          SparseMatrix& A) const {
    const double lambda = stiffness_scale * lambda_, mu = stiffness_scale * mu_;
    parallel_for(
        node_count(),
        [&](int i) {
            const auto row = pattern_.neighbours(i);
            for (int k = 0; k < static_cast<int>(row.size()); ++k) {
                const int j = row[k], block = pattern_.first_block(i) + k;
                if (j < i) continue;
                Eigen::Vector4d outer[3] = {};  // sum of s_a s_b^T, by columns
                for (Eigen::Vector4d& column : outer) column.setZero();
                for (int s = pair_offset_[block]; s < pair_offset_[block + 1]; ++s) {
                    const Eigen::Matrix4d& S = pose.S[static_cast<std::size_t>(pair_[s] / 16)];
                    const int a = pair_[s] / 4 % 4, b = pair_[s] % 4;
                    for (int c = 0; c < 3; ++c) outer[c] += S.col(a) * S(c, b);
                }
                const double diagonal =
                    mu * (outer[0][0] + outer[1][1] + outer[2][2]) + mass_scale * block_mass_[block];
                double value[3][3];  // [row][column] of block (i, j)
                for (int r = 0; r < 3; ++r)
                    for (int c = 0; c < 3; ++c)
                        value[r][c] = lambda * outer[c][r] + mu * outer[r][c] + (r == c ? diagonal : 0);
                // A stored block has the rows of j and the columns of i.
                auto own = pattern_.block(A, i, k);
                if (j == i) {
                    for (int r = 0; r < 3; ++r)
                        for (int c = 0; c < 3; ++c)
                            own(c, r) = 0.5 * (value[r][c] + value[c][r]);  // symmetric to the last bit
                } else {
                    auto mirrored = pattern_.block(A, j, mirror_[block]);
                    for (int r = 0; r < 3; ++r)
                        for (int c = 0; c < 3; ++c) own(c, r) = mirrored(r, c) = value[r][c];
                }
            }
        },
        64);
}

SparseMatrix ElasticBody::stiffness(const ElementPose& pose) const {
    SparseMatrix K = pattern_.zero_matrix();
    combine(0, 1, pose, K);
    return K;
}

void ElasticBody::stiffness_product(const ElementPose& pose, NodesRef u, Eigen::Ref<Nodes> out) const {
    // Works corner by corner without a buffer of element results, so nothing is allocated; the order of sums
    // is that of gather().
    parallel_for(node_count(), [&](int i) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (int s = corner_offset_[i]; s < corner_offset_[i + 1]; ++s) {
            const int t = corner_[s] / 4;
            const Eigen::Matrix<double, 3, 4> S = pose.S[t].topRows<3>();
            // Gradient of u in the element's rotated frame, times the square root of the volume.
            Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
            for (int b = 0; b < 4; ++b) H += u.row(rest_.T(t, b)).transpose() * S.col(b).transpose();
            Eigen::Matrix3d stress = mu_ * (H + H.transpose());
            stress.diagonal().array() += lambda_ * H.trace();
            sum += stress * S.col(corner_[s] % 4);
        }
        out.row(i) = sum.transpose();
    });
}

void ElasticBody::mass_product(NodesRef u, Eigen::Ref<Nodes> out) const {
    parallel_for(node_count(), [&](int i) {
        const auto row = pattern_.neighbours(i);
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (int k = 0; k < static_cast<int>(row.size()); ++k)
            sum += block_mass_[pattern_.first_block(i) + k] * u.row(row[k]).transpose();
        out.row(i) = sum.transpose();
    });
}

void ElasticBody::node_rotations(const ElementPose& pose, std::vector<Eigen::Matrix3f>& rotations) const {
    rotations.resize(static_cast<std::size_t>(node_count()));
    parallel_for(node_count(), [&](int i) {
        Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
        for (int s = corner_offset_[i]; s < corner_offset_[i + 1]; ++s)
            sum += double{corner_weight_[corner_[s]]} * pose.R[corner_[s] / 4];
        rotations[static_cast<std::size_t>(i)] = sum.cast<float>();
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

#include "sim/fem/elastic_body.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "meshing/body/body.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "sim/materials/polar.hpp"

namespace nbd {
namespace {

constexpr int nodes_per_part = 256;  // of sweeps; see SweepOrder

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

}  // namespace

ElasticBody::ElasticBody(TetMesh rest, const Material& material, const std::vector<MaterialRegion>& regions)
    : rest_(checked(std::move(rest))),
      material_(material),
      pattern_(rest_.X.rows(), rest_.T),
      order_(std::make_shared<const SweepOrder>(pattern_.lists(), nodes_per_part)) {
    const std::vector<double> density = set_materials(regions);
    measure_rest();
    list_incidences();
    share_corner_weights();
    lump_masses(density);
}

/// Returns the density of each tetrahedron.
std::vector<double> ElasticBody::set_materials(const std::vector<MaterialRegion>& regions) {
    check_material(material_);
    check_regions(regions, material_, element_count());
    std::vector<double> density;
    for (const Material* material : materials_of_tets(material_, regions, element_count())) {
        const Moduli moduli = moduli_of(*material);
        auto known = std::ranges::find(moduli_, moduli);
        if (known == moduli_.end()) {
            known = moduli_.insert(moduli_.end(), moduli);
            young_.push_back(material->young);
        }
        moduli_of_tet_.push_back(static_cast<std::uint16_t>(known - moduli_.begin()));
        density.push_back(material->density);
    }
    if (moduli_.size() == 1) moduli_of_tet_ = {};
    return density;
}

void ElasticBody::measure_rest() {
    const int padded = (element_count() + lanes - 1) / lanes * lanes;
    volume_.resize(element_count());
    gradient_.resize(padded / lanes);
    corner_weight_.resize(4UL * element_count());
    for (int p = 0; p < padded; ++p) {
        const int t = std::min(p, element_count() - 1);
        Eigen::Matrix3d D;  // edge vectors from the first corner, as columns
        for (int a = 0; a < 3; ++a) D.col(a) = rest_.X.row(rest_.T(t, a + 1)) - rest_.X.row(rest_.T(t, 0));
        volume_[t] = D.determinant() / 6;
        if (!(volume_[t] > 0))
            throw std::invalid_argument(
                fmt::format("tetrahedron {} has volume {} m3; allowed: more than 0", t, volume_[t]));
        const Eigen::Matrix3d gradient = D.inverse().transpose();
        if (!gradient.allFinite())
            throw std::invalid_argument(fmt::format("tetrahedron {} is flat to rounding", t));
        gradient_[p / lanes].set_lane(p % lanes, gradient);
        for (int a = 0; a < 4; ++a)
            corner_weight_[4 * t + a] = static_cast<float>(volume_[t] * shape_gradient(t, a).squaredNorm());
    }
}

void ElasticBody::list_incidences() {
    const Tets& T = rest_.T;
    corners_ = items_by_row({T.data(), 4UL * element_count()}, node_count());
    std::vector<CornerPair> pairs;
    std::vector<int> blocks;
    for (int t = 0; t < element_count(); ++t)
        for (int a = 0; a < 4; ++a)
            for (int b = 0; b < 4; ++b) {
                if (T(t, b) <= T(t, a)) continue;
                blocks.push_back(pattern_.find(T(t, a), T(t, b)));
                pairs.push_back(
                    {16 * t + 4 * a + b,
                     static_cast<float>(volume_[t] * shape_gradient(t, a).dot(shape_gradient(t, b)))});
            }
    RowLists by_block = items_by_row(blocks, pattern_.block_count());
    for (const int item : by_block.column) pair_.push_back(pairs[item]);
    pair_offset_ = std::move(by_block.offset);
    mirror_.resize(pattern_.block_count());
    for (int i = 0; i < node_count(); ++i) {
        const auto row = pattern_.neighbours(i);
        for (int k = 0; k < std::ssize(row); ++k)
            mirror_[pattern_.first_block(i) + k] = pattern_.find(row[k], i) - pattern_.first_block(row[k]);
    }
}

/// The rest gradient of a corner's shape function, 1/m.
Eigen::Vector3d ElasticBody::shape_gradient(int tet, int corner) const {
    const Eigen::Matrix3d gradient = gradient_[tet / lanes].lane(tet % lanes);
    return corner > 0 ? Eigen::Vector3d(gradient.col(corner - 1)) : -gradient.rowwise().sum();
}

void ElasticBody::share_corner_weights() {
    for (int i = 0; i < node_count(); ++i) {
        float total = 0;
        for (const int corner : corners_.columns_of(i)) total += corner_weight_[corner];
        for (const int corner : corners_.columns_of(i)) corner_weight_[corner] /= total;
    }
}

void ElasticBody::lump_masses(const std::vector<double>& density) {
    node_mass_ = Eigen::VectorXd::Zero(node_count());
    for (int i = 0; i < node_count(); ++i)
        for (const int corner : corners_.columns_of(i))
            node_mass_[i] += density[corner / 4] * volume_[corner / 4] / 4;
}

SparseMatrix ElasticBody::mass_matrix() const {
    SparseMatrix M = pattern_.zero_matrix();
    M.diagonal() = node_mass_.replicate<1, 3>().reshaped<Eigen::RowMajor>();
    return M;
}

SparseMatrix ElasticBody::rest_stiffness() const {
    SparseMatrix K = pattern_.zero_matrix();
    for (int t = 0; t < element_count(); ++t) {
        const auto& [law, mu, lambda] = moduli(t);  // all laws agree at rest
        Eigen::Matrix<double, 3, 4> g;
        g.rightCols<3>() = gradient_[t / lanes].lane(t % lanes);
        g.col(0) = -g.rightCols<3>().rowwise().sum();
        for (int a = 0; a < 4; ++a)
            for (int b = 0; b < 4; ++b)
                // A stored block has the rows of b and the columns of a.
                pattern_.block_at(K, rest_.T(t, a), rest_.T(t, b)) +=
                    volume_[t] *
                    (lambda * g.col(b) * g.col(a).transpose() + mu * g.col(a) * g.col(b).transpose() +
                     mu * g.col(a).dot(g.col(b)) * Eigen::Matrix3d::Identity());
    }
    return K;
}

void ElasticBody::sum_forces(const ElementForces& forces, Eigen::Ref<Nodes> out) const {
    // Weights of the forces on nodes 1 to 3 in that on each node. Branches would be mispredicted.
    static const std::array<Eigen::Vector3d, 4> weights{Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d::UnitX(),
                                                        Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()};
    parallel_for(node_count(), [&](int i) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const int corner : corners_.columns_of(i)) sum += forces[corner / 4] * weights[corner % 4];
        out.row(i) = sum.transpose();
    });
}

/// Sets A from the stiffness blocks that block_of(pairs) gives for the pairs of corners of two nodes.
template <class Block>
void ElasticBody::fill(double mass_scale, StepMatrix& A, const Block& block_of) const {
    parallel_for(
        node_count(),
        [&](int i) {
            const auto row = pattern_.neighbours(i);
            for (int k = 0; k < std::ssize(row); ++k) {
                const int j = row[k], block = pattern_.first_block(i) + k;
                if (j <= i) continue;
                const std::span<const CornerPair> pairs(pair_.data() + pair_offset_[block],
                                                        pair_.data() + pair_offset_[block + 1]);
                const Eigen::Matrix3f value = block_of(pairs);
                A.set(i, k, value);
                A.set(j, mirror_[block], value.transpose());
            }
        },
        64);
    A.balance_rows(mass_scale * node_mass_);
}

namespace {

/// The sum of s_a s_b^T over pairs of corners, by columns.
struct OuterSum {
    Eigen::Vector4f columns[3]{Eigen::Vector4f::Zero(), Eigen::Vector4f::Zero(), Eigen::Vector4f::Zero()};

    void add(const Eigen::Matrix4f& S, int a, int b) noexcept {
        for (int c = 0; c < 3; ++c) columns[c] += S.col(a) * S(c, b);
    }
    float trace() const noexcept { return columns[0][0] + columns[1][1] + columns[2][2]; }
    /// lambda s_a s_b^T + mu s_b s_a^T.
    Eigen::Matrix3f block(float lambda, float mu) const noexcept {
        Eigen::Matrix3f value;
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) value(r, c) = lambda * columns[c][r] + mu * columns[r][c];
        return value;
    }
};

}  // namespace

// s_a is column a of S: the gradient of shape function a, rotated by R, times the square root of the volume.
// Block (a, b) of R K_e R^T is lambda s_a s_b^T + mu s_b s_a^T + mu s_a.s_b I. With column t_a of T, that of
// the damping is lambda t_a t_b^T + mu t_b t_a^T + mu s_a.s_b F F^T.
void ElasticBody::combine(double mass_scale, double stiffness_scale, const ElementPose& pose,
                          StepMatrix& A) const {
    if (!pose.blocks.empty()) {
        const auto scale = static_cast<float>(stiffness_scale);
        return fill(mass_scale, A, [&](std::span<const CornerPair> pairs) {
            Eigen::Matrix3f sum = Eigen::Matrix3f::Zero();
            for (const CornerPair& pair : pairs) {
                const TetBlocks& blocks = pose.blocks[pair.at / 16];
                const int a = pair.at / 4 % 4, b = pair.at % 4;
                if (a < b)
                    sum += blocks[pair_of_corners(a, b)];
                else
                    sum += blocks[pair_of_corners(b, a)].transpose();
            }
            sum *= scale;
            return sum;
        });
    }
    const auto lambda = static_cast<float>(stiffness_scale * moduli_[0].lambda),
               mu = static_cast<float>(stiffness_scale * moduli_[0].mu);
    if (pose.rates.empty())
        return fill(mass_scale, A, [&](std::span<const CornerPair> pairs) {
            OuterSum sum;
            for (const CornerPair& pair : pairs) sum.add(pose.S[pair.at / 16], pair.at / 4 % 4, pair.at % 4);
            Eigen::Matrix3f value = sum.block(lambda, mu);
            value.diagonal().array() += mu * sum.trace();
            return value;
        });
    fill(mass_scale, A, [&](std::span<const CornerPair> pairs) {
        OuterSum sum;
        float along = 0;
        Eigen::Vector4f diagonal = Eigen::Vector4f::Zero(), off = Eigen::Vector4f::Zero();
        for (const CornerPair& pair : pairs) {
            const int tet = pair.at / 16;
            const int a = pair.at / 4 % 4, b = pair.at % 4;
            const RateColumns& rates = pose.rates[tet];
            sum.add(pose.S[tet], a, b);
            sum.add(rates.T, a, b);
            along += pair.along;
            diagonal += pair.along * rates.diagonal;
            off += pair.along * rates.off;
        }
        Eigen::Matrix3f value = sum.block(lambda, mu);
        value.diagonal() += mu * diagonal.head<3>();
        value.diagonal().array() += mu * along;
        for (const auto& [r, c, entry] : {std::tuple(0, 1, off[0]), {0, 2, off[1]}, {1, 2, off[2]}}) {
            value(r, c) += mu * entry;
            value(c, r) += mu * entry;
        }
        return value;
    });
}

void ElasticBody::node_rotations(const ElementPose& pose, std::vector<Eigen::Matrix3f>& rotations) const {
    // The lanes of one tetrahedron lie far apart; each is read by four nodes.
    std::vector<Eigen::Matrix3f> of_tets(element_count());
    parallel_for(element_count(),
                 [&](int tet) { of_tets[tet] = pose.R[tet / lanes].lane(tet % lanes).cast<float>(); });
    rotations.resize(node_count());
    parallel_for(node_count(), [&](int i) {
        Eigen::Matrix3f sum = Eigen::Matrix3f::Zero();
        for (const int corner : corners_.columns_of(i)) sum += corner_weight_[corner] * of_tets[corner / 4];
        rotations[i] = sum;
    });
}

}  // namespace nbd

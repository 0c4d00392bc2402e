#include "sim/fem/elastic_body.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <stdexcept>
#include <tuple>

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

ElasticBody::ElasticBody(TetMesh rest, const Material& material, MassKind mass,
                         const std::vector<MaterialRegion>& regions)
    : rest_(checked(std::move(rest))),
      material_(material),
      pattern_(rest_.X.rows(), rest_.T),
      order_(std::make_shared<const SweepOrder>(pattern_.offsets(), pattern_.columns(), nodes_per_part)) {
    const std::vector<double> density = set_materials(regions);
    measure_rest();
    list_incidences();
    share_corner_weights();
    build_mass(mass, density);
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
        for (int a = 0; a < 4; ++a) {
            const Eigen::Vector3d g =
                a > 0 ? Eigen::Vector3d(gradient.col(a - 1)) : -gradient.rowwise().sum();
            corner_weight_[4 * t + a] = static_cast<float>(volume_[t] * g.squaredNorm());
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
                if (T(t, b) > T(t, a)) ++pairs[pattern_.find(T(t, a), T(t, b))];
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
                if (T(t, b) > T(t, a))
                    pair_[next_pair[pattern_.find(T(t, a), T(t, b))]++] = {
                        16 * t + 4 * a + b,
                        static_cast<float>(volume_[t] * shape_gradient(t, a).dot(shape_gradient(t, b)))};
        }
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
        for (int s = corner_offset_[i]; s < corner_offset_[i + 1]; ++s) total += corner_weight_[corner_[s]];
        for (int s = corner_offset_[i]; s < corner_offset_[i + 1]; ++s) corner_weight_[corner_[s]] /= total;
    }
}

void ElasticBody::build_mass(MassKind kind, const std::vector<double>& density) {
    node_mass_ = Eigen::VectorXd::Zero(node_count());
    for (int i = 0; i < node_count(); ++i)
        for (int s = corner_offset_[i]; s < corner_offset_[i + 1]; ++s)
            node_mass_[i] += density[corner_[s] / 4] * volume_[corner_[s] / 4] / 4;
    if (kind == MassKind::lumped) return;
    // The integral of two shape functions over a tetrahedron is a 20th of its volume, that of a square a
    // 10th.
    block_mass_.assign(pattern_.block_count(), 0);
    for (int t = 0; t < element_count(); ++t)
        for (int a = 0; a < 4; ++a)
            for (int b = 0; b < 4; ++b)
                block_mass_[pattern_.find(rest_.T(t, a), rest_.T(t, b))] +=
                    density[t] * volume_[t] / (a == b ? 10 : 20);
}

/// The mass of a block off the diagonal.
double ElasticBody::block_mass(int block) const noexcept {
    return block_mass_.empty() ? 0 : block_mass_[block];
}

SparseMatrix ElasticBody::mass_matrix() const {
    SparseMatrix M = pattern_.zero_matrix();
    for (int i = 0; i < node_count(); ++i)
        for (int k = 0; k < std::ssize(pattern_.neighbours(i)); ++k) {
            const bool own = pattern_.neighbours(i)[k] == i;
            const double mass =
                own && block_mass_.empty() ? node_mass_[i] : block_mass(pattern_.first_block(i) + k);
            pattern_.block(M, i, k).diagonal().setConstant(mass);
        }
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
            for (int b = 0; b < 4; ++b) {
                const int i = rest_.T(t, a), k = pattern_.find(i, rest_.T(t, b)) - pattern_.first_block(i);
                // A stored block has the rows of b and the columns of a.
                pattern_.block(K, i, k) +=
                    volume_[t] *
                    (lambda * g.col(b) * g.col(a).transpose() + mu * g.col(a) * g.col(b).transpose() +
                     mu * g.col(a).dot(g.col(b)) * Eigen::Matrix3d::Identity());
            }
    }
    return K;
}

void ElasticBody::sum_forces(const ElementForces& forces, Eigen::Ref<Nodes> out) const {
    // Weights of the forces on nodes 1 to 3 in that on each node. Branches would be mispredicted.
    static const std::array<Eigen::Vector3d, 4> weights{Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d::UnitX(),
                                                        Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()};
    parallel_for(node_count(), [&](int i) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (int s = corner_offset_[i]; s < corner_offset_[i + 1]; ++s)
            sum += forces[corner_[s] / 4] * weights[corner_[s] % 4];
        out.row(i) = sum.transpose();
    });
}

/// Sets A from the stiffness blocks that block(pairs, mass) gives for the pairs of corners of two nodes and
/// their mass.
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
                const Eigen::Matrix3f value =
                    block_of(pairs, static_cast<float>(mass_scale * block_mass(block)));
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
        return fill(mass_scale, A, [&](std::span<const CornerPair> pairs, float mass) {
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
            sum.diagonal().array() += mass;
            return sum;
        });
    }
    const auto lambda = static_cast<float>(stiffness_scale * moduli_[0].lambda),
               mu = static_cast<float>(stiffness_scale * moduli_[0].mu);
    if (pose.rates.empty())
        return fill(mass_scale, A, [&](std::span<const CornerPair> pairs, float mass) {
            OuterSum sum;
            for (const CornerPair& pair : pairs) sum.add(pose.S[pair.at / 16], pair.at / 4 % 4, pair.at % 4);
            Eigen::Matrix3f value = sum.block(lambda, mu);
            value.diagonal().array() += mu * sum.trace() + mass;
            return value;
        });
    fill(mass_scale, A, [&](std::span<const CornerPair> pairs, float mass) {
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
        value.diagonal().array() += mu * along + mass;
        for (const auto& [r, c, entry] : {std::tuple(0, 1, off[0]), {0, 2, off[1]}, {1, 2, off[2]}}) {
            value(r, c) += mu * entry;
            value(c, r) += mu * entry;
        }
        return value;
    });
}

StepMatrix ElasticBody::stiffness(const ElementPose& pose) const {
    StepMatrix K = zero_matrix();
    combine(0, 1, pose, K);
    return K;
}

void ElasticBody::mass_product(NodesRef u, Eigen::Ref<Nodes> out) const {
    if (block_mass_.empty()) {
        out = node_mass_.asDiagonal() * u;
        return;
    }
    parallel_for(node_count(), [&](int i) {
        const auto row = pattern_.neighbours(i);
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (int k = 0; k < std::ssize(row); ++k)
            sum += block_mass_[pattern_.first_block(i) + k] * u.row(row[k]).transpose();
        out.row(i) = sum.transpose();
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
        for (int s = corner_offset_[i]; s < corner_offset_[i + 1]; ++s)
            sum += corner_weight_[corner_[s]] * of_tets[corner_[s] / 4];
        rotations[i] = sum;
    });
}

}  // namespace nbd

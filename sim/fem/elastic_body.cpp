#include "sim/fem/elastic_body.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <span>
#include <stdexcept>
#include <tuple>
#include <type_traits>
#include <utility>

#include "meshing/body/body.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/fem/quadratic_points.hpp"
#include "sim/materials/polar.hpp"

namespace nbd {
namespace {

constexpr int nodes_per_part = 256;  // of sweeps; see SweepOrder
/// Most of lambda at the points of quadratic elements, over mu, as at Poisson's ratio 0.3: as measured by
/// bars, plates and blocks of all ratios, see `nbdtree-bench physics`.
constexpr double most_at_points = 1.5;

// Runs before the pattern is built, which needs valid indices.
TetMesh checked(TetMesh mesh) {
    const Eigen::Index nodes = mesh.X.rows();
    if (mesh.T.rows() == 0) throw std::invalid_argument("elastic body: no tetrahedra; allowed: at least one");
    if (mesh.is_quadratic() && mesh.E.rows() != mesh.T.rows())
        throw std::invalid_argument(fmt::format("elastic body: {} tetrahedra, but nodes of edges of {}",
                                                mesh.T.rows(), mesh.E.rows()));
    if (mesh.fill.rows() > 0 && mesh.fill.rows() != mesh.T.rows())
        throw std::invalid_argument(
            fmt::format("elastic body: {} tetrahedra, but fill of {}", mesh.T.rows(), mesh.fill.rows()));
    std::vector<char> used(nodes, 0);
    const auto of_tets = nodes_of_tets(mesh);
    for (Eigen::Index t = 0; t < of_tets.rows(); ++t)
        for (const int node : of_tets.row(t)) {
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
      pattern_(rest_.X.rows(), nodes_of_tets(rest_)),
      order_(std::make_shared<const SweepOrder>(pattern_.lists(), nodes_per_part)) {
    const std::vector<double> density = set_materials(regions);
    measure_rest();
    list_incidences();
    share_corner_weights();
    set_masses(density);
}

/// Returns the density of each tetrahedron.
std::vector<double> ElasticBody::set_materials(const std::vector<MaterialRegion>& regions) {
    check_material(material_);
    check_regions(regions, material_, element_count());
    std::vector<double> density;
    for (const Material* material : materials_of_tets(material_, regions, element_count())) {
        Moduli moduli = moduli_of(*material);
        constexpr double rounding = 1e-12;
        double of_mean = 0;
        if (rest_.is_quadratic() && moduli.lambda > (1 + rounding) * most_at_points * moduli.mu) {
            of_mean = moduli.lambda - most_at_points * moduli.mu;
            moduli.lambda = most_at_points * moduli.mu;
        }
        std::size_t known = 0;
        while (known < moduli_.size() && !(moduli_[known] == moduli && mean_lambda_[known] == of_mean))
            ++known;
        if (known == moduli_.size()) {
            moduli_.push_back(moduli);
            mean_lambda_.push_back(of_mean);
            has_mean_ = has_mean_ || of_mean > 0;
            young_.push_back(material->young);
        }
        moduli_of_tet_.push_back(static_cast<std::uint16_t>(known));
        density.push_back(material->density);
    }
    if (moduli_.size() == 1) moduli_of_tet_ = {};
    return density;
}

void ElasticBody::measure_rest() {
    corner_tets_ = nbd::corner_tets(rest_);
    const int points = point_count(), padded = (points + lanes - 1) / lanes * lanes;
    volume_.resize(element_count());
    for (int t = 0; t < element_count(); ++t) {
        volume_[t] = volume(rest_, t) * rest_.filled(t);
        if (!(volume_[t] > 0))
            throw std::invalid_argument(
                fmt::format("tetrahedron {} has volume {} m3; allowed: more than 0", t, volume_[t]));
    }
    set_points();
    gradient_.resize(padded / lanes);
    corner_weight_.resize(4UL * points);
    for (int lane = 0; lane < padded; ++lane) {
        const int p = std::min(lane, points - 1), t = p / points_per_tet();
        Eigen::Matrix3d D;  // edge vectors from the first corner, as columns
        for (int a = 0; a < 3; ++a)
            D.col(a) = rest_.X.row(corner_tets_(p, a + 1)) - rest_.X.row(corner_tets_(p, 0));
        const Eigen::Matrix3d gradient = D.inverse().transpose();
        if (!gradient.allFinite())
            throw std::invalid_argument(fmt::format("tetrahedron {} is flat to rounding", t));
        gradient_[lane / lanes].set_lane(lane % lanes, gradient);
        for (int a = 0; a < 4; ++a)
            corner_weight_[4 * p + a] =
                static_cast<float>(volume_[t] * corner_gradients(p).col(a).squaredNorm());
    }
}

void ElasticBody::list_incidences() {
    corners_ = items_by_row({corner_tets_.data(), 4UL * point_count()}, node_count());
    std::vector<NodePair> pairs;
    std::vector<int> blocks;
    const auto of_tets = nodes_of_tets(rest_);
    const int n = nodes_per_tet();
    for (int t = 0; t < element_count(); ++t)
        for (int a = 0; a < n; ++a)
            for (int b = 0; b < n; ++b) {
                if (of_tets(t, b) <= of_tets(t, a)) continue;
                blocks.push_back(pattern_.find(of_tets(t, a), of_tets(t, b)));
                NodePair& pair = pairs.emplace_back(NodePair{n * (n * t + a) + b, 0});
                if (rest_.is_quadratic()) continue;
                const Eigen::Matrix<double, 3, 4> g = corner_gradients(t);
                pair.along = static_cast<float>(volume_[t] * g.col(a).dot(g.col(b)));
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

/// The rest gradients of the shape functions of a corner tetrahedron, 1/m.
Eigen::Matrix<double, 3, 4> ElasticBody::corner_gradients(int corner_tet) const {
    Eigen::Matrix<double, 3, 4> g;
    g.rightCols<3>() = gradient_[corner_tet / lanes].lane(corner_tet % lanes);
    g.col(0) = -g.rightCols<3>().rowwise().sum();
    return g;
}

NodeGradients ElasticBody::node_gradients(int tet, int point) const {
    if (!rest_.is_quadratic()) return corner_gradients(tet);
    NodeGradients G = NodeGradients::Zero(3, 10);
    const auto z = [&](int corner) { return points(tet)(point, corner); };
    for (int a = 0; a < 4; ++a) G.col(a) = z(a) * corner_gradients(4 * tet + a).col(a);
    for (int k = 0; k < 6; ++k) {
        const auto [a, b] = edges_of_tet[k];
        G.col(4 + k) =
            z(a) * corner_gradients(4 * tet + a).col(b) + z(b) * corner_gradients(4 * tet + b).col(a);
    }
    return G;
}

void ElasticBody::share_corner_weights() {
    for (int i = 0; i < node_count(); ++i) {
        float total = 0;
        for (const int corner : corners_.columns_of(i)) total += corner_weight_[corner];
        for (const int corner : corners_.columns_of(i)) corner_weight_[corner] /= total;
    }
}

void ElasticBody::set_points() {
    const int count = rest_.fill.rows() > 0 ? element_count() : 1;
    for (int t = 0; t < count; ++t) {
        Eigen::Matrix<double, 1, 10> fill = Eigen::Matrix<double, 1, 10>::Constant(0.1);
        if (rest_.fill.rows() > 0) fill = rest_.fill.row(t);
        points_.push_back(points_of_fill(fill));
    }
}

void ElasticBody::set_masses(const std::vector<double>& density) {
    const auto of_tets = nodes_of_tets(rest_);
    const int n = nodes_per_tet();
    node_mass_ = Eigen::VectorXd::Zero(node_count());
    const bool is_consistent = rest_.is_quadratic() || is_rigid();
    if (is_consistent) mass_.assign(pattern_.block_count(), 0);
    const ShapeProducts of_full = products_in_full_tet();
    for (int t = 0; t < element_count(); ++t) {
        const double mass = density[t] * volume_[t];
        const bool is_full = std::abs(rest_.filled(t) - 1) < 1e-9;
        ShapeProducts products = is_full ? of_full : products_at(points(t));
        if (n == 4) products.topLeftCorner<4, 4>() = points(t).transpose() * points(t) / 4;
        for (int i = 0; i < n; ++i) {
            const double share = is_full ? 1.0 / n : products.row(i).head(n).sum();
            node_mass_[of_tets(t, i)] += mass * share;
            for (int j = 0; j < n && is_consistent; ++j)
                mass_[pattern_.find(of_tets(t, i), of_tets(t, j))] += mass * products(i, j);
        }
    }
}

SparseMatrix ElasticBody::mass_matrix() const {
    SparseMatrix M = pattern_.zero_matrix();
    if (mass_.empty()) M.diagonal() = node_mass_.replicate<1, 3>().reshaped<Eigen::RowMajor>();
    for (int i = 0; i < node_count() && !mass_.empty(); ++i)
        for (int k = 0; k < std::ssize(pattern_.neighbours(i)); ++k)
            pattern_.block(M, i, k).diagonal().setConstant(mass_[pattern_.first_block(i) + k]);
    return M;
}

Nodes ElasticBody::mass_product(NodesRef u) const {
    if (mass_.empty()) return node_mass_.asDiagonal() * u;
    Nodes product(node_count(), 3);
    parallel_for(node_count(), [&](int i) {
        const auto row = pattern_.neighbours(i);
        Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
        for (int k = 0; k < std::ssize(row); ++k) sum += mass_[pattern_.first_block(i) + k] * u.row(row[k]);
        product.row(i) = sum;
    });
    return product;
}

SparseMatrix ElasticBody::rest_stiffness() const {
    SparseMatrix K = pattern_.zero_matrix();
    const auto of_tets = nodes_of_tets(rest_);
    for (int p = 0; p < point_count(); ++p) {
        const int t = p / points_per_tet();
        const auto& [law, mu, lambda] = moduli(t);  // all laws agree at rest
        const double weight = volume_[t] / points_per_tet();
        const NodeGradients g = node_gradients(t, p % points_per_tet());
        NodeGradients mean = NodeGradients::Zero(3, nodes_per_tet());
        if (mean_lambda(t) > 0)
            for (int q = 0; q < points_per_tet(); ++q) mean += node_gradients(t, q) / points_per_tet();
        for (int a = 0; a < nodes_per_tet(); ++a)
            for (int b = 0; b < nodes_per_tet(); ++b)
                // A stored block has the rows of b and the columns of a.
                pattern_.block_at(K, of_tets(t, a), of_tets(t, b)) +=
                    weight * (lambda * g.col(b) * g.col(a).transpose() +
                              mean_lambda(t) * mean.col(b) * mean.col(a).transpose() +
                              mu * g.col(a) * g.col(b).transpose() +
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

/// Sets A from the stiffness blocks that block_of(pairs) gives for what two nodes have in each tetrahedron.
template <class Block>
void ElasticBody::fill(double mass_scale, StepMatrix& A, const Block& block_of) const {
    parallel_for(
        node_count(),
        [&](int i) {
            const auto row = pattern_.neighbours(i);
            for (int k = 0; k < std::ssize(row); ++k) {
                const int j = row[k], block = pattern_.first_block(i) + k;
                if (j <= i) continue;
                const std::span<const NodePair> pairs(pair_.data() + pair_offset_[block],
                                                      pair_.data() + pair_offset_[block + 1]);
                Eigen::Matrix3f value = block_of(pairs);
                if (!mass_.empty()) value.diagonal().array() += static_cast<float>(mass_scale * mass_[block]);
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

template <class Blocks>
void ElasticBody::sum_blocks(double mass_scale, double stiffness_scale, const std::vector<Blocks>& of_tets,
                             StepMatrix& A) const {
    constexpr int n = std::is_same_v<Blocks, TetBlocks> ? 4 : 10;
    const auto scale = static_cast<float>(stiffness_scale);
    fill(mass_scale, A, [&](std::span<const NodePair> pairs) {
        Eigen::Matrix3f sum = Eigen::Matrix3f::Zero();
        for (const NodePair& pair : pairs) {
            const Blocks& blocks = of_tets[pair.at / (n * n)];
            const int a = pair.at / n % n, b = pair.at % n;
            if (a < b)
                sum += blocks[pair_of_nodes<n>(a, b)];
            else
                sum += blocks[pair_of_nodes<n>(b, a)].transpose();
        }
        sum *= scale;
        return sum;
    });
}

// s_a is column a of S: the gradient of shape function a, rotated by R, times the square root of the volume.
// Block (a, b) of R K_e R^T is lambda s_a s_b^T + mu s_b s_a^T + mu s_a.s_b I. With column t_a of T, that of
// the damping is lambda t_a t_b^T + mu t_b t_a^T + mu s_a.s_b F F^T.
void ElasticBody::combine(double mass_scale, double stiffness_scale, const ElementPose& pose,
                          StepMatrix& A) const {
    if (is_rigid()) return combine_rigidly(mass_scale, stiffness_scale, pose, A);
    if (!pose.blocks.empty()) return sum_blocks(mass_scale, stiffness_scale, pose.blocks, A);
    if (!pose.quadratic_blocks.empty())
        return sum_blocks(mass_scale, stiffness_scale, pose.quadratic_blocks, A);
    const auto lambda = static_cast<float>(stiffness_scale * moduli_[0].lambda),
               mu = static_cast<float>(stiffness_scale * moduli_[0].mu);
    if (pose.rates.empty())
        return fill(mass_scale, A, [&](std::span<const NodePair> pairs) {
            OuterSum sum;
            for (const NodePair& pair : pairs) sum.add(pose.S[pair.at / 16], pair.at / 4 % 4, pair.at % 4);
            Eigen::Matrix3f value = sum.block(lambda, mu);
            value.diagonal().array() += mu * sum.trace();
            return value;
        });
    fill(mass_scale, A, [&](std::span<const NodePair> pairs) {
        OuterSum sum;
        float along = 0;
        Eigen::Vector4f diagonal = Eigen::Vector4f::Zero(), off = Eigen::Vector4f::Zero();
        for (const NodePair& pair : pairs) {
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

/// As combine(), in double precision, for the one tetrahedron of a rigid body.
void ElasticBody::combine_rigidly(double mass_scale, double stiffness_scale, const ElementPose& pose,
                                  StepMatrix& A) const {
    Eigen::Matrix<double, 12, 12> K;
    ElementForces scratch;
    Nodes unit = Nodes::Zero(4, 3), forces(4, 3);
    for (int column = 0; column < 12; ++column) {
        unit.data()[column] = 1;
        tangent_product(pose, unit, scratch, forces);
        K.col(column) = stiffness_scale * forces.reshaped<Eigen::RowMajor>();
        unit.data()[column] = 0;
    }
    for (int i = 0; i < 4; ++i) {
        const auto row = pattern_.neighbours(i);
        for (int k = 0; k < 4; ++k) {
            if (row[k] == i) continue;
            const Eigen::Matrix3d mass =
                mass_scale * mass_[pattern_.first_block(i) + k] * Eigen::Matrix3d::Identity();
            A.set_exactly(i, k, mass + K.block<3, 3>(3 * i, 3 * row[k]));
        }
    }
    A.balance_rows(mass_scale * node_mass_);
}

double ElasticBody::energy_by_linear_strain(const ElementPose& pose, NodesRef x) const {
    const Eigen::Matrix3d F = pose.R[0].lane(0).transpose() * deformation_gradient(x, 0);
    const Eigen::Matrix3d strain = (F + F.transpose()) / 2 - Eigen::Matrix3d::Identity();
    return volume_[0] *
           (moduli_[0].mu * strain.squaredNorm() + moduli_[0].lambda / 2 * std::pow(strain.trace(), 2));
}

void ElasticBody::node_rotations(const ElementPose& pose, std::vector<Eigen::Matrix3f>& rotations) const {
    // The lanes of one point lie far apart; each is read by four nodes.
    std::vector<Eigen::Matrix3f> of_points(point_count());
    parallel_for(point_count(),
                 [&](int p) { of_points[p] = pose.R[p / lanes].lane(p % lanes).cast<float>(); });
    rotations.resize(node_count());
    parallel_for(node_count(), [&](int i) {
        Eigen::Matrix3f sum = Eigen::Matrix3f::Zero();
        for (const int corner : corners_.columns_of(i)) sum += corner_weight_[corner] * of_points[corner / 4];
        rotations[i] = sum;
    });
}

}  // namespace nbd

// The passes of ElasticBody over the elements of a pose: `lanes` tetrahedra at a time.
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/fem/elastic_body.hpp"
#include "sim/fem/quadratic_points.hpp"

namespace nbd {
namespace {

/// Edge vectors from the first corner, as columns.
Eigen::Matrix3d edges(NodesRef x, const Tets& T, int t) {
    Eigen::Matrix3d D;
    for (int a = 0; a < 3; ++a) D.col(a) = (x.row(T(t, a + 1)) - x.row(T(t, 0))).transpose();
    return D;
}

Lanes determinants(const LaneMatrix3& A) noexcept {
    return A(0, 0) * (A(1, 1) * A(2, 2) - A(2, 1) * A(1, 2)) -
           A(1, 0) * (A(0, 1) * A(2, 2) - A(2, 1) * A(0, 2)) +
           A(2, 0) * (A(0, 1) * A(1, 2) - A(1, 1) * A(0, 2));
}

/// Energy densities of the corotated law.
Lanes corotated_energy(const LaneModuli& moduli, const LaneMatrix3& F, const LaneMatrix3& R) noexcept {
    Lanes trace = Lanes::Constant(-3), strain = Lanes::Zero();
    for (std::size_t k = 0; k < 9; ++k) {
        trace += R.entries[k] * F.entries[k];
        strain += (F.entries[k] - R.entries[k]).square();
    }
    return moduli.mu * strain + 0.5 * moduli.lambda * trace.square();
}

/// U diag(stress) V^T.
LaneMatrix3 turned_back(const PrincipalStretches& stretches, const PrincipalLanes& stress) noexcept {
    const auto& [U, V, sigma] = stretches;
    LaneMatrix3 P;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            P(i, j) =
                stress[0] * U(i, 0) * V(j, 0) + stress[1] * U(i, 1) * V(j, 1) + stress[2] * U(i, 2) * V(j, 2);
    return P;
}

/// Adds the report on later tetrahedra.
void append(ElementReport& all, const ElementReport& later) {
    all.energy += later.energy;
    if (all.inverted == 0) all.first_inverted = later.first_inverted;
    all.inverted += later.inverted;
    if (all.non_finite == 0) all.first_non_finite = later.first_non_finite;
    all.non_finite += later.non_finite;
    all.min_det = std::min(all.min_det, later.min_det);
    if (later.stretch > all.stretch) {
        all.stretch = later.stretch;
        all.most_stretched = later.most_stretched;
    }
}

}  // namespace

Eigen::Matrix3d ElasticBody::deformation_gradient(NodesRef x, int tet) const {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (int p = points_per_tet() * tet; p < points_per_tet() * (tet + 1); ++p)
        sum += edges(x, corner_tets_, p) * gradient_[p / lanes].lane(p % lanes).transpose();
    return sum / points_per_tet();
}

/// The deformation gradients at the points of a batch.
void ElasticBody::gradients(NodesRef x, int batch, LaneMatrix3& F) const {
    LaneMatrix3 D;
    for (int l = 0; l < lanes; ++l) D.set_lane(l, edges(x, corner_tets_, point_in(batch, l)));
    const LaneMatrix3& g = gradient_[batch];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) F(i, j) = D(i, 0) * g(j, 0) + D(i, 1) * g(j, 1) + D(i, 2) * g(j, 2);
    if (rest_.is_quadratic()) mix_lanes(points_in(batch), F);
}

LaneModuli ElasticBody::lane_moduli(int batch) const {
    LaneModuli result;
    for (int l = 0; l < lanes; ++l) {
        const auto& [law, mu, lambda] = moduli(point_in(batch, l) / points_per_tet());
        result.law[l] = law;
        result.mu[l] = mu;
        result.lambda[l] = lambda;
    }
    return result;
}

/// What resists the mean of the dilatation over each tetrahedron, Pa.
Lanes ElasticBody::mean_pressure(int batch, const Lanes& dilatation) const {
    Lanes pressure;
    for (int first = 0; first < lanes; first += 4)
        pressure.segment<4>(first).setConstant(mean_lambda(point_in(batch, first) / points_per_tet()) *
                                               dilatation.segment<4>(first).mean());
    return pressure;
}

/// Adds what the mean dilatation does by the velocity gradients H of a batch.
void ElasticBody::add_mean_response(int batch, const LaneMatrix3& dilation, const LaneMatrix3& H,
                                    LaneMatrix3& P) const {
    Lanes rate = Lanes::Zero();
    for (std::size_t k = 0; k < 9; ++k) rate += dilation.entries[k] * H.entries[k];
    const Lanes push = volumes(batch) * mean_pressure(batch, rate);
    for (std::size_t k = 0; k < 9; ++k) P.entries[k] += push * dilation.entries[k];
}

PrincipalResponse ElasticBody::response(int batch, const PrincipalLanes& sigma) const {
    const LaneModuli moduli = lane_moduli(batch);
    PrincipalResponse response = respond(moduli, sigma);
    if (!has_mean_) return response;
    const Lanes dilated = dilatation(moduli, sigma).value, pressure = mean_pressure(batch, dilated);
    for (int first = 0; first < lanes; first += 4)
        response.energy.segment<4>(first) += 0.5 * pressure[first] * dilated.segment<4>(first).mean();
    add_pressure(moduli, sigma, pressure, response);
    return response;
}

PrincipalLanes ElasticBody::principal_stretches_of(NodesRef x, int batch) const {
    LaneMatrix3 F, R;
    gradients(x, batch, F);
    rotations_of(F, R);
    return principal_stretches(F, R).sigma;
}

void ElasticBody::stress_of(NodesRef x, int batch, LaneMatrix3& F, LaneMatrix3& P) const {
    LaneMatrix3 R;
    gradients(x, batch, F);
    rotations_of(F, R);
    const PrincipalStretches stretches = principal_stretches(F, R);
    P = turned_back(stretches, response(batch, stretches.sigma).stress);
}

ElementReport ElasticBody::measure(NodesRef x) const {
    constexpr int batches_per_task = 64;
    const int batches = gradient_.size();
    std::vector<ElementReport> parts((batches + batches_per_task - 1) / batches_per_task);
    parallel_for(
        parts.size(),
        [&](int task) {
            const int end = std::min(batches, (task + 1) * batches_per_task);
            for (int batch = task * batches_per_task; batch < end; ++batch)
                measure_batch(x, batch, parts[task]);
        },
        1);
    ElementReport report;
    for (const ElementReport& part : parts) append(report, part);
    return report;
}

/// Adds a batch to the report on earlier ones.
void ElasticBody::measure_batch(NodesRef x, int batch, ElementReport& report) const {
    LaneMatrix3 F, R;
    gradients(x, batch, F);
    rotations_of(F, R);
    Lanes squared = Lanes::Zero();
    for (std::size_t k = 0; k < 9; ++k) squared += F.entries[k].square();
    const Lanes det = determinants(F),
                density = is_corotated() && !has_mean_
                              ? corotated_energy(lane_moduli(batch), F, R)
                              : response(batch, principal_stretches(F, R).sigma).energy;
    const Lanes volume = volumes(batch);
    constexpr double least_filled = 0.01;  // what is nearly empty may turn inside out
    int inverted = -1, non_finite = -1;    // the last such tetrahedron
    for (int l = 0; l < points_of(batch); ++l) {
        const int tet = (first_point(batch) + l) / points_per_tet();
        if (!std::isfinite(det[l])) {
            if (std::exchange(non_finite, tet) != tet && report.non_finite++ == 0)
                report.first_non_finite = tet;
            continue;
        }
        report.energy += volume[l] * density[l];
        if (rest_.filled(tet) < least_filled) continue;
        report.min_det = std::min(report.min_det, det[l]);
        if (det[l] <= 0 && std::exchange(inverted, tet) != tet && report.inverted++ == 0)
            report.first_inverted = tet;
        if (const double stretch = std::sqrt(squared[l]); stretch > report.stretch) {
            report.stretch = stretch;
            report.most_stretched = tet;
        }
    }
}

bool ElasticBody::is_corotated() const noexcept {
    return (moduli_.size() == 1 || rest_.is_quadratic()) &&
           std::ranges::all_of(moduli_, [](const Moduli& m) { return m.law == MaterialLaw::corotated; });
}

void ElasticBody::pose(NodesRef x, ElementPose& pose, ElementForces& forces, Tangent tangent,
                       const StepMotion* motion) const {
    const std::size_t tets = element_count();
    const bool corotated = is_corotated() && tangent == Tangent::rotated, quadratic = rest_.is_quadratic(),
               is_damped = motion && motion->damping > 0;
    pose.R.resize(gradient_.size());
    pose.S.resize(corotated && !quadratic ? tets : 0);
    pose.tangents.resize(corotated ? 0 : gradient_.size());
    pose.blocks.resize(corotated || quadratic ? 0 : tets);
    pose.quadratic_blocks.resize(quadratic ? tets : 0);
    pose.dilation.resize(has_mean_ && !corotated ? gradient_.size() : 0);
    pose.F.resize(is_damped ? gradient_.size() : 0);
    pose.damping = is_damped ? motion->damping : 0;
    pose.rates.resize(corotated && !quadratic && is_damped ? tets : 0);
    forces.resize(point_count());
    parallel_for(
        gradient_.size(),
        [&](int batch) {
            if (corotated)
                corotated_batch(x, batch, motion, pose, forces);
            else
                principal_batch(x, batch, motion, pose, forces, tangent);
        },
        64);
}

/// Those that belong to the points, m3.
Lanes ElasticBody::volumes(int batch) const {
    Lanes volume;
    for (int l = 0; l < lanes; ++l)
        volume[l] = volume_[point_in(batch, l) / points_per_tet()] / points_per_tet();
    return volume;
}

/// K by the velocity gradients H of a batch.
LaneMatrix3 ElasticBody::elastic_response(int batch, const ElementPose& pose, const LaneMatrix3& H) const {
    LaneMatrix3 P = pose.tangents.empty() ? strain_form(batch, pose.R[batch]).multiply(H)
                                          : pose.tangents[batch].multiply(H);
    if (has_mean_) add_mean_response(batch, (pose.dilation.empty() ? pose.R : pose.dilation)[batch], H, P);
    return P;
}

/// Likewise D.
LaneMatrix3 ElasticBody::damping_response(int batch, const ElementPose& pose, const LaneMatrix3& H) const {
    LaneMatrix3 P = strain_form(batch, pose.F[batch]).multiply(H);
    if (has_mean_) add_mean_response(batch, pose.F[batch], H, P);
    return P;
}

/// Makes P, of the forces, that of the impulses of a step, and sets the deformation gradients by which its
/// strain rates are measured. F: at the end of the step.
void ElasticBody::add_motion(int batch, const LaneMatrix3& F, const StepMotion& motion, ElementPose& pose,
                             LaneMatrix3& P) const {
    LaneMatrix3 H;
    gradients(motion.w, batch, H);
    const LaneMatrix3 change = elastic_response(batch, pose, H);
    for (std::size_t k = 0; k < 9; ++k)
        P.entries[k] = motion.dt * (P.entries[k] + motion.dt * change.entries[k]);
    if (pose.F.empty()) return;
    const double back = (1 - motion.strain_rate_at) * motion.dt;
    LaneMatrix3& of_rates = pose.F[batch];
    for (std::size_t k = 0; k < 9; ++k) of_rates.entries[k] = F.entries[k] - back * H.entries[k];
}

void ElasticBody::corotated_batch(NodesRef x, int batch, const StepMotion* motion, ElementPose& pose,
                                  ElementForces& forces) const {
    const auto [law, mu, lambda] = lane_moduli(batch);
    const Lanes volume = volumes(batch);
    LaneMatrix3 F, P;
    gradients(x, batch, F);
    LaneMatrix3& R = pose.R[batch];
    rotations_of(F, R);
    Lanes trace = Lanes::Constant(-3);
    for (std::size_t k = 0; k < 9; ++k) trace += R.entries[k] * F.entries[k];
    Lanes pressure = lambda * trace;
    if (has_mean_) pressure += mean_pressure(batch, trace);
    for (std::size_t k = 0; k < 9; ++k)
        P.entries[k] = -volume * (2 * mu * (F.entries[k] - R.entries[k]) + pressure * R.entries[k]);
    if (motion) add_motion(batch, F, *motion, pose, P);
    store_forces(batch, P, forces);
    if (rest_.is_quadratic()) {
        LaneBlocks blocks;
        for (LaneMatrix3& block : blocks) block.entries.fill(Lanes::Zero());
        strain_form(batch, R).add_blocks(gradient_[batch], blocks);
        return store_blocks(batch, blocks, pose);
    }
    store_columns(batch, R, volume, [&](std::size_t tet) -> Eigen::Matrix4f& { return pose.S[tet]; });
    if (!pose.rates.empty()) store_rates(batch, pose);
}

void ElasticBody::principal_batch(NodesRef x, int batch, const StepMotion* motion, ElementPose& pose,
                                  ElementForces& forces, Tangent tangent) const {
    const Lanes volume = volumes(batch);
    const LaneModuli moduli = lane_moduli(batch);
    LaneMatrix3 F, P;
    gradients(x, batch, F);
    LaneMatrix3& R = pose.R[batch];
    rotations_of(F, R);
    const PrincipalStretches stretches = principal_stretches(F, R);
    PrincipalResponse response = this->response(batch, stretches.sigma);
    P = turned_back(stretches, response.stress);
    for (Lanes& entry : P.entries) entry *= -volume;
    if (tangent != Tangent::exact) response.project();
    if (tangent == Tangent::rotated)
        for (int l = 0; l < lanes; ++l)
            if (moduli.law[l] == MaterialLaw::corotated)
                for (Lanes& twist : response.twist) twist[l] = 0;
    ElementTangent& kept = pose.tangents[batch];
    kept = ElementTangent(stretches, response, volume);
    if (has_mean_) pose.dilation[batch] = turned_back(stretches, dilatation(moduli, stretches.sigma).slope);
    if (motion) add_motion(batch, F, *motion, pose, P);
    store_forces(batch, P, forces);
    LaneBlocks blocks;
    stiffness_blocks(kept, gradient_[batch], blocks);
    store_blocks(batch, blocks, pose);
}

/// Stores the blocks of the elasticity, with damping. of_points: of linear tetrahedra at the points.
void ElasticBody::store_blocks(int batch, LaneBlocks& of_points, ElementPose& pose) const {
    if (pose.damping != 0) add_damping(batch, pose, of_points);
    if (!rest_.is_quadratic())
        return nbd::store_blocks(of_points, points_of(batch), &pose.blocks[first_point(batch)]);
    std::array<TetBlocks, lanes> points;
    nbd::store_blocks(of_points, lanes, points.data());
    for (int first = 0; first < points_of(batch); first += 4) {
        const int tet = (first_point(batch) + first) / 4;
        pose.quadratic_blocks[tet] =
            stiffness_of_points(this->points(tet), std::span(points).subspan(first).first<4>());
    }
    if (!has_mean_) return;
    add_mean_blocks(batch, (pose.dilation.empty() ? pose.R : pose.dilation)[batch], 1, pose);
    if (pose.damping != 0) add_mean_blocks(batch, pose.F[batch], pose.damping, pose);
}

/// Adds what the mean dilatation of each tetrahedron does to its blocks, times a factor: V mean_lambda
/// s_a s_b^T, where s_a is the mean over the points of `dilation` times the gradient of node a's function.
void ElasticBody::add_mean_blocks(int batch, const LaneMatrix3& dilation, double factor,
                                  ElementPose& pose) const {
    LaneMatrix3 of_corners = dilation;
    mix_lanes_transposed(points_in(batch), of_corners);
    for (int first = 0; first < points_of(batch); first += 4) {
        const int tet = (first_point(batch) + first) / 4;
        Eigen::Matrix<double, 3, 10> s = Eigen::Matrix<double, 3, 10>::Zero();
        const auto add = [&](int node, int corner, int at) {
            s.col(node) += of_corners.lane(first + corner) * corner_gradients(4 * tet + corner).col(at) / 4;
        };
        for (int a = 0; a < 4; ++a) add(a, a, a);
        for (int k = 0; k < 6; ++k) {
            const auto [a, b] = edges_of_tet[k];
            add(4 + k, a, b);
            add(4 + k, b, a);
        }
        s *= std::sqrt(factor * mean_lambda(tet) * volume_[tet]);
        const Eigen::Matrix<float, 3, 10> single = s.cast<float>();
        for (int i = 0; i < 10; ++i)
            for (int j = i + 1; j < 10; ++j)
                pose.quadratic_blocks[tet][pair_of_nodes<10>(i, j)] +=
                    single.col(i) * single.col(j).transpose();
    }
}

/// Adds its share of the damping to the blocks of the elasticity.
void ElasticBody::add_damping(int batch, const ElementPose& pose, LaneBlocks& blocks) const {
    StrainForm form = strain_form(batch, pose.F[batch]);
    form.lambda *= pose.damping;
    form.mu *= pose.damping;
    form.add_blocks(gradient_[batch], blocks);
}

/// The columns F grad N_a of a batch, times the root of `weight`. columns_of(tet): where to.
template <class ColumnsOf>
void ElasticBody::store_columns(int batch, const LaneMatrix3& F, const Lanes& weight,
                                const ColumnsOf& columns_of) const {
    const LaneMatrix3& g = gradient_[batch];
    const Lanes root = weight.sqrt();
    for (int i = 0; i < 3; ++i) {
        Lanes S[4];
        S[0] = Lanes::Zero();
        for (int a = 0; a < 3; ++a) {
            S[a + 1] = root * (F(i, 0) * g(0, a) + F(i, 1) * g(1, a) + F(i, 2) * g(2, a));
            S[0] -= S[a + 1];
        }
        for (int l = 0; l < points_of(batch); ++l) {
            Eigen::Matrix4f& columns = columns_of(first_point(batch) + l);
            for (int a = 0; a < 4; ++a) columns(i, a) = static_cast<float>(S[a][l]);
        }
    }
    for (int l = 0; l < points_of(batch); ++l) columns_of(first_point(batch) + l).row(3).setZero();
}

void ElasticBody::store_rates(int batch, ElementPose& pose) const {
    const LaneMatrix3& F = pose.F[batch];
    store_columns(batch, F, pose.damping * volumes(batch),
                  [&](std::size_t tet) -> Eigen::Matrix4f& { return pose.rates[tet].T; });
    const auto entry = [&](int i, int j) -> Lanes {  // of F F^T
        return pose.damping * (F(i, 0) * F(j, 0) + F(i, 1) * F(j, 1) + F(i, 2) * F(j, 2));
    };
    const Lanes xx = entry(0, 0), yy = entry(1, 1), zz = entry(2, 2), xy = entry(0, 1), xz = entry(0, 2),
                yz = entry(1, 2);
    for (int l = 0; l < points_of(batch); ++l) {
        RateColumns& of_tet = pose.rates[first_point(batch) + l];
        of_tet.diagonal = Eigen::Vector4d(xx[l], yy[l], zz[l], 0).cast<float>();
        of_tet.off = Eigen::Vector4d(xy[l], xz[l], yz[l], 0).cast<float>();
    }
}

/// The forces on nodes 1 to 3 of a batch of corner tetrahedra. P: minus the stress at the points [Pa] times
/// volume.
void ElasticBody::store_forces(int batch, LaneMatrix3 P, ElementForces& forces) const {
    const LaneMatrix3& g = gradient_[batch];
    if (rest_.is_quadratic()) mix_lanes_transposed(points_in(batch), P);
    for (int i = 0; i < 3; ++i)
        for (int a = 0; a < 3; ++a) {
            const Lanes f = P(i, 0) * g(0, a) + P(i, 1) * g(1, a) + P(i, 2) * g(2, a);
            for (int l = 0; l < points_of(batch); ++l) forces[first_point(batch) + l](i, a) = f[l];
        }
}

/// The form of a batch with the moduli of its elements, times their volumes. F: of the batch.
StrainForm ElasticBody::strain_form(int batch, const LaneMatrix3& F) const {
    const LaneModuli moduli = lane_moduli(batch);
    const Lanes volume = volumes(batch);
    return {F, moduli.lambda * volume, moduli.mu * volume};
}

/// out = (of_stiffness K + of_damping D) u.
void ElasticBody::product(const ElementPose& pose, NodesRef u, double of_stiffness, double of_damping,
                          ElementForces& scratch, Eigen::Ref<Nodes> out) const {
    scratch.resize(point_count());
    parallel_for(
        gradient_.size(),
        [&](int batch) {
            LaneMatrix3 H, P;
            gradients(u, batch, H);
            if (of_stiffness == 0)
                for (Lanes& entry : P.entries) entry.setZero();
            else
                P = elastic_response(batch, pose, H);
            if (of_damping != 0) {
                const LaneMatrix3 damping = damping_response(batch, pose, H);
                for (std::size_t k = 0; k < 9; ++k)
                    P.entries[k] = of_stiffness * P.entries[k] + of_damping * damping.entries[k];
            }
            store_forces(batch, P, scratch);
        },
        64);
    sum_forces(scratch, out);
}

Nodes ElasticBody::inner_forces(NodesRef x, NodesRef v) const {
    ElementPose scratch;
    ElementForces of_elements;
    const Nodes still = Nodes::Zero(node_count(), 3);
    // Impulses over a second in which nothing moves.
    const StepMotion motion{.w = still, .dt = 1, .damping = material_.rayleigh_stiffness};
    pose(x, scratch, of_elements, Tangent::rotated, &motion);
    Nodes forces(node_count(), 3), damping(node_count(), 3);
    sum_forces(of_elements, forces);
    damping_product(scratch, v, of_elements, damping);
    return forces - material_.rayleigh_stiffness * damping;
}

void ElasticBody::damping_product(const ElementPose& pose, NodesRef u, ElementForces& scratch,
                                  Eigen::Ref<Nodes> out) const {
    product(pose, u, 0, pose.F.empty() ? 0 : 1, scratch, out);
}

void ElasticBody::tangent_product(const ElementPose& pose, NodesRef u, ElementForces& scratch,
                                  Eigen::Ref<Nodes> out) const {
    product(pose, u, 1, pose.damping, scratch, out);
}

}  // namespace nbd

#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "meshing/body/body.hpp"
#include "meshing/body/rigid_body.hpp"
#include "meshing/surface/mesh.hpp"
#include "sim/factor/block_pattern.hpp"
#include "sim/fem/quadratic_points.hpp"
#include "sim/fem/step_matrix.hpp"
#include "sim/materials/element_tangent.hpp"
#include "sim/materials/material_law.hpp"
#include "sim/materials/polar.hpp"

namespace nbd {

/// What ElasticBody::measure() finds in a pose.
struct ElementReport {
    double energy = 0;  // elastic, joules
    int inverted = 0;   // tetrahedra with det F <= 0; here and below, of those filled by a hundredth or more
    int first_inverted = -1;  // lowest index of these; -1 if none
    int non_finite = 0;       // tetrahedra with a NaN or infinity in F; the other figures leave them out
    int first_non_finite = -1;
    double min_det = std::numeric_limits<double>::infinity();  // smallest finite det F
    double stretch = 0;                                        // largest Frobenius norm of F
    int most_stretched = -1;                                   // its tetrahedron
    bool ok() const noexcept { return inverted == 0 && non_finite == 0; }
};

/// Of the damping of a tetrahedron: like ElementPose::S with F in place of R, and the diagonal and the
/// entries (0, 1), (0, 2), (1, 2) of F F^T. The fourth numbers are zero.
struct RateColumns {
    Eigen::Matrix4f T;
    Eigen::Vector4f diagonal, off;
};

/// Element results for one pose, of which matrices and their products are made. Owned by the caller, filled
/// by ElasticBody::pose(). Batches are of `lanes` points of integration.
struct ElementPose {
    // [batches] rotations of the deformation gradients, det = +1 even if inverted
    std::vector<LaneMatrix3> R;
    // Of linear tetrahedra of one corotated material; otherwise empty. [T]; see ElasticBody::combine(). The
    // fourth row is zero.
    std::vector<Eigen::Matrix4f> S;
    // Of bodies that are not of one corotated material, and of full tangents; otherwise empty.
    std::vector<ElementTangent> tangents;  // [batches] times volume
    // K + damping D of each tetrahedron, see StepMotion, where S is empty: of linear or of quadratic ones.
    std::vector<TetBlocks> blocks;                     // [T]
    std::vector<QuadraticTetBlocks> quadratic_blocks;  // [T]
    // Derivatives of the dilatation by F, where they count and are not R; otherwise empty.
    std::vector<LaneMatrix3> dilation;  // [batches]
    // Of a step with damping: its deformation gradients F, see StepMotion; otherwise empty.
    std::vector<LaneMatrix3> F;      // [batches]
    double damping = 0;              // see StepMotion; 0 without
    std::vector<RateColumns> rates;  // [T] of a step with damping where S is not empty; otherwise empty
};

/// A step of the length dt that ends in a pose x with velocities w, so that its forces are linear in them.
/// Its damping D v is the force against the strain rates E = sym(F^T grad v) with the Lame parameters of
/// elasticity, where F are the deformation gradients at the share strain_rate_at of the way from x - dt w to
/// x. At rest it is K v. It vanishes for rotations: with F halfway between two poses, E is the change of
/// Green's strain between them.
struct StepMotion {
    NodesRef w;     // [N, 3] m/s
    double dt = 0;  // seconds
    double strain_rate_at = 1;
    double damping = 0;  // weight of D beside K: the matrix of the step is K + damping D
};

/// What is kept of the derivative of the corotated stress.
enum class Tangent {
    rotated,  // all but the derivative of the rotation
    full,     // all, without negative eigenvalues
    exact,    // all: the matrix of a body that is about to buckle is not positive definite
};

/// Gradients of the shape functions of a tetrahedron's nodes at a point, 1/m.
using NodeGradients = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 10>;

/// Forces of each of the ElasticBody's corner tetrahedra on its nodes 1 to 3, as columns, N. Node 0 has
/// minus their sum.
using ElementForces = std::vector<Eigen::Matrix3d>;

/// Elasticity on linear or quadratic tetrahedra: forces, energies and products in double precision, matrices
/// of poses in single precision. The laws are those of `respond`; a body may have regions of several.
///
/// Energy is integrated over what TetMesh::fill says is material, by one point in a linear tetrahedron and by
/// four in a quadratic one, see points_of_fill(): exact for products of its deformation gradients, which are
/// linear. Gradients at the points are sums of those at
/// corners, which are those of its corner_tets(), so that both kinds run through the same loops.
///
/// Energy of a corotated element: E_e = V (mu |F - R|^2 + lambda/2 tr(R^T F - I)^2), where R is the rotation
/// of F's polar decomposition. The force f_e = -R K_e (R^T x - X) is exactly -dE_e/dx: the derivative of R
/// drops out because R^T F is symmetric. The tangent K = sum of R K_e R^T neglects dR/dx and is therefore
/// positive semi-definite in every pose; where R^T F = I it is the exact Hessian. The tangents of other laws
/// are exact but for negative eigenvalues, which become zero element by element. Masses of linear tetrahedra
/// are lumped, of full ones a quarter at each node; those of quadratic ones and of rigid bodies are
/// consistent, and have the mass, centre and inertia of the material.
///
/// In rubber, whose lambda is far above mu, quadratic elements would lock by keeping their volume at each
/// point. There lambda is at most that of Poisson's ratio 0.3, and what is beyond it resists the mean of the
/// dilatation over the element: its energy gets V/2 mean_lambda (mean of the dilatation)^2, a mean dilatation
/// [NagtegaalParksRice74] that is stabilised by the rest [PusoSolberg06].
///
/// Immutable: several simulated copies and threads may share it, each with its own ElementPose. All loops run
/// in parallel and sum in a fixed order, so the bits do not depend on the number of threads.
class ElasticBody {
 public:
    /// Throws std::invalid_argument naming the first bad parameter, node or tetrahedron: parameters outside
    /// the ranges of Material, no tetrahedra, an index out of range, a non-finite position, a tetrahedron
    /// without positive volume, a node in no tetrahedron, a region with a tetrahedron of another region or
    /// with damping of its own.
    ElasticBody(TetMesh rest, const Material& material, const std::vector<MaterialRegion>& regions = {});

    /// The tetrahedra of a body, with its materials.
    explicit ElasticBody(const Body& body) : ElasticBody(body.tets, body.material, body.regions) {}

    int node_count() const noexcept { return rest_.X.rows(); }
    int element_count() const noexcept { return rest_.T.rows(); }
    bool is_rigid() const noexcept { return nbd::is_rigid(rest_); }
    int unknown_count() const noexcept { return 3 * node_count(); }
    const TetMesh& rest() const noexcept { return rest_; }
    /// Of integration: point p belongs to tetrahedron p / points_per_tet().
    int points_per_tet() const noexcept { return rest_.is_quadratic() ? 4 : 1; }
    int point_count() const noexcept { return points_per_tet() * element_count(); }
    /// See nbd::corner_tets(). [points, 4].
    const Tets& corner_tets() const noexcept { return corner_tets_; }
    /// Shared by this body and its copies, and by no other. A cache that holds it weakly cannot take a new
    /// body for an old one, as it might by the address.
    struct Identity {};
    const std::shared_ptr<const Identity>& identity() const noexcept { return identity_; }
    const Material& material() const noexcept { return material_; }  // outside of regions
    /// At the points of integration.
    const Moduli& moduli(int tet) const noexcept { return moduli_[moduli_index(tet)]; }
    /// Of quadratic tetrahedra: what of lambda resists their mean dilatation alone, Pa.
    double mean_lambda(int tet) const noexcept { return mean_lambda_[moduli_index(tet)]; }
    double young(int tet) const noexcept { return young_[moduli_index(tet)]; }  // Pa
    const Eigen::VectorXd& rest_volumes() const noexcept { return volume_; }    // [T], m3
    const Eigen::VectorXd& node_masses() const noexcept { return node_mass_; }  // [N] sums of M's rows, kg
    double mass() const noexcept { return node_mass_.sum(); }                   // kg
    const BlockPattern& pattern() const noexcept { return pattern_; }
    SparseMatrix mass_matrix() const;  // in pattern(), kg
    /// M u. u: [N, 3].
    Nodes mass_product(NodesRef u) const;
    /// K in the rest pose, in double precision, in pattern(), N/m.
    SparseMatrix rest_stiffness() const;

    // Points are processed in batches of `lanes`, all points of a tetrahedron in one. In results of a batch,
    // those of lanes after its last point have no meaning.
    int batch_count() const noexcept { return gradient_.size(); }
    int first_point(int batch) const noexcept { return batch * lanes; }
    int points_of(int batch) const noexcept { return std::min(lanes, point_count() - batch * lanes); }
    LaneModuli lane_moduli(int batch) const;
    /// The response to principal stretches with the pressure of the mean dilatation.
    PrincipalResponse response(int batch, const PrincipalLanes& sigma) const;
    PrincipalLanes principal_stretches_of(NodesRef x, int batch) const;
    /// Deformation gradients and first Piola-Kirchhoff stresses P = dpsi/dF, Pa, for the positions x, [N, 3].
    void stress_of(NodesRef x, int batch, LaneMatrix3& F, LaneMatrix3& P) const;

    /// The mean deformation gradient of a tetrahedron for the positions x, [N, 3].
    Eigen::Matrix3d deformation_gradient(NodesRef x, int tet) const;

    /// Measures the elements at the positions x [N, 3], metres.
    ElementReport measure(NodesRef x) const;

    /// Fills the results and the elastic forces for the positions x [N, 3], metres. Allocates only on the
    /// first use of both. Non-finite elements get R = I and pass their NaN on to the forces. motion: makes
    /// `forces` the impulses dt f + dt^2 K w of the step.
    void pose(NodesRef x, ElementPose& pose, ElementForces& forces, Tangent tangent = Tangent::rotated,
              const StepMotion* motion = nullptr) const;

    /// The elastic energy of a rigid body, joules, with its strain to first order about the rotation of a
    /// pose: what a step along straight lines adds to it by turning is no strain, see StepPotential. x: [4,
    /// 3].
    double energy_by_linear_strain(const ElementPose& pose, NodesRef x) const;

    /// The forces of elasticity and the damping of stiffness on the nodes, newtons, at the positions x with
    /// the velocities v, all [N, 3].
    Nodes inner_forces(NodesRef x, NodesRef v) const;

    /// Sums the elements' forces on the nodes, newtons. out: [N, 3].
    void sum_forces(const ElementForces& forces, Eigen::Ref<Nodes> out) const;

    /// Zeros, with the blocks of pattern(). The body must outlive the matrix.
    StepMatrix zero_matrix() const { return {pattern_, order_, is_rigid()}; }

    /// A = mass_scale * M + stiffness_scale * (K + damping D)(pose), in place. A must come from
    /// zero_matrix().
    void combine(double mass_scale, double stiffness_scale, const ElementPose& pose, StepMatrix& A) const;

    /// out = (K + damping D)(pose) u without assembling the matrix, in double precision. u, out: [N, 3]; out
    /// must not overlap u.
    void tangent_product(const ElementPose& pose, NodesRef u, ElementForces& scratch,
                         Eigen::Ref<Nodes> out) const;
    /// Likewise D(pose) u.
    void damping_product(const ElementPose& pose, NodesRef u, ElementForces& scratch,
                         Eigen::Ref<Nodes> out) const;

    /// Means of the rotations R of the elements around each node, weighted with their stiffness: [N],
    /// rotations up to a factor where the elements turn alike. Allocates only on the first use.
    void node_rotations(const ElementPose& pose, std::vector<Eigen::Matrix3f>& rotations) const;

 private:
    void measure_rest();
    void list_incidences();
    void share_corner_weights();
    std::vector<double> set_materials(const std::vector<MaterialRegion>& regions);
    int point_in(int batch, int lane) const noexcept {
        return first_point(batch) + std::min(lane, points_of(batch) - 1);
    }
    void gradients(NodesRef x, int batch, LaneMatrix3& F) const;
    Lanes volumes(int batch) const;
    void set_points();
    const TetPoints& points(int tet) const noexcept { return points_[points_.size() > 1 ? tet : 0]; }
    std::array<const TetPoints*, lanes / 4> points_in(int batch) const noexcept {
        return {&points(point_in(batch, 0) / 4), &points(point_in(batch, 4) / 4)};
    }
    void measure_batch(NodesRef x, int batch, ElementReport& report) const;
    void add_motion(int batch, const LaneMatrix3& F, const StepMotion& motion, ElementPose& pose,
                    LaneMatrix3& P) const;
    void corotated_batch(NodesRef x, int batch, const StepMotion* motion, ElementPose& pose,
                         ElementForces& forces) const;
    Eigen::Matrix<double, 3, 4> corner_gradients(int corner_tet) const;
    NodeGradients node_gradients(int tet, int point) const;
    void set_masses(const std::vector<double>& density);
    void store_blocks(int batch, LaneBlocks& of_points, ElementPose& pose) const;
    int nodes_per_tet() const noexcept { return rest_.is_quadratic() ? 10 : 4; }
    template <class ColumnsOf>
    void store_columns(int batch, const LaneMatrix3& F, const Lanes& weight,
                       const ColumnsOf& columns_of) const;
    void store_rates(int batch, ElementPose& pose) const;
    void add_damping(int batch, const ElementPose& pose, LaneBlocks& blocks) const;
    void principal_batch(NodesRef x, int batch, const StepMotion* motion, ElementPose& pose,
                         ElementForces& forces, Tangent tangent) const;
    Lanes mean_pressure(int batch, const Lanes& dilatation) const;
    void add_mean_response(int batch, const LaneMatrix3& dilation, const LaneMatrix3& H,
                           LaneMatrix3& P) const;
    void add_mean_blocks(int batch, const LaneMatrix3& dilation, double factor, ElementPose& pose) const;
    LaneMatrix3 elastic_response(int batch, const ElementPose& pose, const LaneMatrix3& H) const;
    LaneMatrix3 damping_response(int batch, const ElementPose& pose, const LaneMatrix3& H) const;
    StrainForm strain_form(int batch, const LaneMatrix3& F) const;
    void product(const ElementPose& pose, NodesRef u, double of_stiffness, double of_damping,
                 ElementForces& scratch, Eigen::Ref<Nodes> out) const;
    std::size_t moduli_index(int tet) const noexcept {
        return moduli_of_tet_.empty() ? 0 : moduli_of_tet_[tet];
    }
    void combine_rigidly(double mass_scale, double stiffness_scale, const ElementPose& pose,
                         StepMatrix& A) const;
    template <class Block>
    void fill(double mass_scale, StepMatrix& A, const Block& block) const;
    template <class Blocks>
    void sum_blocks(double mass_scale, double stiffness_scale, const std::vector<Blocks>& of_tets,
                    StepMatrix& A) const;
    bool is_corotated() const noexcept;
    void store_forces(int batch, LaneMatrix3 P, ElementForces& forces) const;

    std::shared_ptr<const Identity> identity_ = std::make_shared<const Identity>();
    TetMesh rest_;
    Material material_;
    std::vector<Moduli> moduli_;                // distinct
    std::vector<std::uint16_t> moduli_of_tet_;  // [T] index in moduli_; empty if there is one alone
    std::vector<double> young_;                 // of moduli_, Pa
    std::vector<double> mean_lambda_;           // likewise
    bool has_mean_ = false;                     // whether one of these is not 0
    BlockPattern pattern_;
    std::shared_ptr<const SweepOrder> order_;  // of the pattern
    Eigen::VectorXd volume_;                   // [T] that is filled
    std::vector<TetPoints> points_;            // [T]; [1] if all are full
    Tets corner_tets_;                         // [points, 4]
    // Rest gradients of the shape functions 1 to 3 of corner tetrahedra, 1/m: columns of the transposed
    // inverse of the rest edges. Stored in batches of `lanes`; the last batch repeats its last one.
    std::vector<LaneMatrix3> gradient_;
    // [4 points] volume times squared norm of the shape function's gradient, as a share of the node's sum.
    std::vector<float> corner_weight_;
    Eigen::VectorXd node_mass_;  // [N]
    std::vector<double> mass_;   // [blocks] of quadratic tetrahedra: M, each times the identity; else empty

    RowLists corners_;  // of each node, 4 p + a of corner tetrahedra, ascending: the fixed order of all sums
    // Nodes a, b of a tetrahedron t; of linear ones, its volume times the product of the gradients of their
    // shape functions.
    struct NodePair {
        int at;  // n (n t + a) + b with n nodes of a tetrahedron
        float along;
    };
    // Those of each block (i, j) with j > i, by block number. The other triangle is mirrored when written,
    // and the diagonal follows from the sums of rows.
    std::vector<int> pair_offset_;  // [blocks + 1]
    std::vector<NodePair> pair_;
    std::vector<int> mirror_;  // [blocks] for block (i, j), the position of i among the neighbours of j
};

}  // namespace nbd

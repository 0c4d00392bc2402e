#include "tests/collision/models.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <iterator>

namespace nbd::shapes {

Modes make_modes(const Surface& s, int mode_count, int representatives, unsigned seed) {
    std::mt19937 random(seed);
    const Eigen::Index n = s.X.rows();
    Eigen::MatrixXd U(3 * n, mode_count), rigid(3 * n, 6);
    for (int j = 0; j < mode_count; ++j) {
        const Vertices moved = wobbled(s.X, random, 0.3f) - s.X;
        U.col(j) = Eigen::Map<const Eigen::VectorXf>(moved.data(), 3 * n).cast<double>();
    }
    for (Eigen::Index v = 0; v < n; ++v)
        for (int axis = 0; axis < 3; ++axis) {
            const Eigen::Vector3d e = Eigen::Vector3d::Unit(axis), X = s.X.row(v).transpose().cast<double>();
            rigid.col(axis).segment<3>(3 * v) = e;
            rigid.col(3 + axis).segment<3>(3 * v) = e.cross(X);
        }

    Modes modes;
    ClusteredModes& c = modes.clustered;
    c.w.resize(representatives);
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(3 * n);
    for (int i = 0; i < representatives; ++i) {
        c.representatives.push_back(static_cast<int>(i * n / representatives));
        c.w[i] = 2 + uniform(random);
        weights.segment<3>(3 * c.representatives.back()).setConstant(c.w[i]);
    }
    const Eigen::MatrixXd weighted = weights.asDiagonal() * rigid;
    U -= rigid * (weighted.transpose() * rigid).ldlt().solve(weighted.transpose() * U);
    modes.U = U.cast<float>();

    c.X.resize(representatives, 3);
    Eigen::MatrixXf rows(3 * representatives, mode_count);
    for (int i = 0; i < representatives; ++i) {
        const Eigen::Index v = c.representatives[i];
        c.X.row(i) = s.X.row(v);
        rows.middleRows<3>(3 * i) = modes.U.middleRows<3>(3 * v);
    }
    c.U = FixedMatrix(rows);
    return modes;
}

Vertices nbd_pose(const Surface& s, const Eigen::MatrixXf& U, const Eigen::VectorXf& q) {
    const Eigen::VectorXf shift = U * q;
    return s.X + Eigen::Map<const Vertices>(shift.data(), s.X.rows(), 3);
}

FixedVector fixed(const Eigen::VectorXf& numbers) {
    FixedVector x(numbers.size());
    x.numbers() = numbers;
    x.fix();
    return x;
}

Sphere nbd_sphere(const NbdModel& model, const SphereTree& tree, int node, const FixedVector& zn) {
    Sphere sphere;
    nbd_spheres(model, tree, node, zn, {&sphere, 1});
    return sphere;
}

NbdModel random_model(const SphereTree& tree, const ClusteredModes& modes, int hidden, unsigned seed) {
    std::mt19937 random(seed);
    NbdModel model;
    model.modes = modes;
    const int m = model.mode_count();
    model.z_centre = Eigen::VectorXf::NullaryExpr(m, [&](Eigen::Index) { return 0.1f * uniform(random); });
    model.z_scale = Eigen::VectorXf::NullaryExpr(m, [&](Eigen::Index) { return 0.05f * uniform(random); });
    std::vector<float> weights(tree.nodes.size() *
                               static_cast<std::size_t>(NbdNetworks::weight_count(m, hidden)));
    for (float& w : weights) w = 0.3f * uniform(random);
    model.networks = NbdNetworks(m, hidden, weights);
    const Eigen::Index nodes = tree.nodes.size();
    model.out_centre = Eigen::MatrixXf::NullaryExpr(
        4, nodes, [&](Eigen::Index, Eigen::Index) { return 0.05f * uniform(random); });
    model.out_scale = Eigen::MatrixXf::NullaryExpr(
        4, nodes, [&](Eigen::Index, Eigen::Index) { return 0.1f * uniform(random); });
    return model;
}

std::shared_ptr<const LearnedAffineModel> sampled_affine_model(const CollisionTree& tree, VerticesRef X) {
    const WideTree& wide = tree.boxes->tree();
    LearnedAffineFit fit;
    fit.X = X;
    const auto add_part = [&](const WideTree::Children& children) {
        std::vector<int> vertices;
        for (const std::vector<int>& child : children) {
            vertices.insert(vertices.end(), child.begin(), child.end());
            fit.growth.push_back(child.empty() ? 0 : 0.5f);
        }
        constexpr std::size_t count = LearnedAffineFit::samples_per_part;
        for (std::size_t k = 0; k < count; ++k) fit.samples.push_back(vertices[k * vertices.size() / count]);
        fit.residual.push_back(0.01f);
    };
    for (int i = 0; i < wide.clusters(); ++i) {
        add_part(wide.cluster_children(i));
        fit.clusters.push_back({0.1f, 1, 1});
        for (std::size_t k = 0; k < LearnedAffineFit::samples_per_box; ++k)
            fit.box_samples.push_back(*(fit.samples.end() - LearnedAffineFit::samples_per_part +
                                        static_cast<std::ptrdiff_t>(2 * k)));
    }
    for (int i = 0; i < wide.blocks(); ++i) add_part(wide.block_children(i));
    return std::make_shared<const LearnedAffineModel>(wide, std::move(fit));
}

CollisionTree full_tree(const Surface& s, const Modes& modes, const SphereTreeConfig& config) {
    CollisionTree tree = make_exact_tree(s.X, s.F, config);
    tree.bd = build_bd_model(tree.spheres, modes.U, modes.clustered);
    tree.nbd = random_model(tree.spheres, modes.clustered, 32, 5);
    tree.learned_affine = sampled_affine_model(tree, s.X);
    for (const BoundKind kind : bound_kinds)
        if (can_miss(kind) && has_bounds(tree, kind)) tree.calibrations[kind] = no_margins(tree, kind);
    return tree;
}

std::shared_ptr<const CollisionTree> shared_full_tree(const Surface& s, int mode_count, int representatives,
                                                      unsigned seed, const SphereTreeConfig& config) {
    return std::make_shared<const CollisionTree>(
        full_tree(s, make_modes(s, mode_count, representatives, seed), config));
}

std::vector<BoundKind> kinds_of(const CollisionTree& tree) {
    std::vector<BoundKind> kinds;
    std::ranges::copy_if(bound_kinds, std::back_inserter(kinds),
                         [&](BoundKind kind) { return has_bounds(tree, kind); });
    return kinds;
}

Calibration no_margins(const CollisionTree& tree, BoundKind kind) {
    return {.miss_rate = 0.5,
            .confidence = 0.5,
            .trajectories = 1,
            .poses = 1,
            .margins = std::vector<float>(bound_count(tree, kind), 0.f)};
}

}  // namespace nbd::shapes

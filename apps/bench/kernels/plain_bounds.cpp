#include "apps/bench/kernels/plain_bounds.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <span>

namespace nbd {
namespace {

using Matrix = Eigen::Map<const Eigen::MatrixXf>;
using Vector = Eigen::Map<const Eigen::VectorXf>;

Eigen::MatrixX3f rows_of(VerticesRef x, std::span<const int> vertices) {
    Eigen::MatrixX3f rows(static_cast<Eigen::Index>(vertices.size()), 3);
    for (std::size_t i = 0; i < vertices.size(); ++i)
        rows.row(static_cast<Eigen::Index>(i)) = x.row(vertices[i]);
    return rows;
}

/// Returns W x + b and moves `values` past W and b.
Eigen::VectorXf layer(const float*& values, const Eigen::VectorXf& x, Eigen::Index out) {
    const Eigen::VectorXf y = Matrix(values, out, x.size()) * x + Vector(values + out * x.size(), out);
    values += out * (x.size() + 1);
    return y;
}

}  // namespace

Sphere plain_learned_sphere(const LearnedModel& model, int node, VerticesRef x) {
    const LearnedModel::Node& n = model.nodes[static_cast<std::size_t>(node)];
    const Eigen::MatrixX3f samples = rows_of(x, model.node_samples(node));
    const float* values = model.values.data() + n.value_begin;
    const Vector weights(values, n.sample_count);
    const Eigen::RowVector3f c = weights.transpose() * samples;
    const Eigen::VectorXf distances = (samples.rowwise() - c).rowwise().norm();
    const LearnedModel::Reach reach = model.reach(node);
    float growth = reach.growth;
    if (model.network && !n.exact) {
        values += 3 * n.sample_count;
        const Eigen::VectorXf h1 = layer(values, distances, LearnedModel::hidden).cwiseMax(0);
        const Eigen::VectorXf h2 = layer(values, h1, LearnedModel::hidden).cwiseMax(0);
        growth = std::clamp(growth + Vector(values, LearnedModel::hidden).dot(h2), reach.low, reach.high);
    }
    return {c.transpose(), distances.maxCoeff() + growth};
}

Box plain_learned_box(const LearnedModel& model, int node, VerticesRef x) {
    const Eigen::MatrixX3f samples = rows_of(x, model.node_samples(node));
    const Eigen::RowVector3f mean = samples.colwise().mean();
    const float spread = std::sqrt((samples.rowwise() - mean).rowwise().squaredNorm().mean()),
                growth = model.boxes[static_cast<std::size_t>(node)].growth * spread;
    Box box = empty_box();
    box.lo.head<3>() = samples.colwise().minCoeff().transpose().array() - growth;
    box.hi.head<3>() = samples.colwise().maxCoeff().transpose().array() + growth;
    box.lo[3] = box.hi[3] = 0;
    return box;
}

PlainNbd::PlainNbd(const NbdModel& model)
    : model_(&model),
      U_(model.modes.U.numbers()),
      centre_map_(model.centre_map.numbers()),
      weights_(model.networks.weights()) {}

Sphere PlainNbd::sphere(const SphereTree& tree, int node, const Eigen::VectorXf& zn) const {
    const int hidden = model_->networks.hidden();
    const float* weights = weights_.data() + std::ptrdiff_t{node} * model_->networks.weight_count();
    const Eigen::VectorXf h1 = layer(weights, zn, hidden).cwiseMax(0);
    const Eigen::VectorXf h2 = layer(weights, h1, hidden).cwiseMax(0);
    Eigen::VectorXf o = layer(weights, h2, NbdModel::outputs);
    o = o.cwiseProduct(model_->out_scale.col(node)) + model_->out_centre.col(node);
    if (centre_map_.size() > 0)
        o.head<3>() += centre_map_.middleCols(3 * Eigen::Index{node}, 3).transpose() * zn;
    const Sphere& rest = tree.rest[static_cast<std::size_t>(node)];
    return {rest.c + o.head<3>(), std::max(0.f, rest.r + o[3])};
}

Eigen::VectorXf PlainNbd::coordinates(VerticesRef x) const {
    const ClusteredModes& modes = model_->modes;
    const Eigen::MatrixX3d p = rows_of(x, modes.representatives).cast<double>(), X = modes.X.cast<double>();
    const Eigen::VectorXd w = modes.w.cast<double>();
    const Eigen::RowVector3d mean_p = w.transpose() * p / w.sum(), mean_X = w.transpose() * X / w.sum();
    const Eigen::Matrix3d A = (p.rowwise() - mean_p).transpose() * w.asDiagonal() * (X.rowwise() - mean_X);
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const bool reflected = svd.matrixU().determinant() * svd.matrixV().determinant() < 0;
    const Eigen::Matrix3d R =
        svd.matrixU() * Eigen::Vector3d(1, 1, reflected ? -1 : 1).asDiagonal() * svd.matrixV().transpose();
    const Eigen::MatrixX3d y = ((p.rowwise() - mean_p) * R).rowwise() + mean_X;
    const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> d =
        (w.asDiagonal() * (y - X)).cast<float>();
    return U_.transpose() * Vector(d.data(), d.size());
}

}  // namespace nbd

#include "collision/nbd_tree/nbd_bound.hpp"

#include <algorithm>
#include <cmath>

#include "collision/base/message.hpp"

namespace nbd {

void nbd_spheres(const NbdModel& model, const SphereTree& tree, int first, const FixedVector& zn,
                 std::span<Sphere> spheres) noexcept {
    constexpr int most = NbdNetworks::max_at_once;
    Eigen::Array4f results[most];
    Eigen::Matrix<float, 3, most> linear = Eigen::Matrix<float, 3, most>::Zero();
    const Eigen::Index count = spheres.size();
    const FixedColumns columns = model.centre_map.size() > 0
                                     ? model.centre_map.columns(3 * Eigen::Index{first}, 3 * count)
                                     : FixedColumns{};
    model.networks.evaluate(first, zn, std::span(results).first(spheres.size()), columns, linear.data());
    for (std::size_t i = 0; i < spheres.size(); ++i) {
        const auto node = static_cast<Eigen::Index>(i) + first;
        const Eigen::Array4f delta =
            results[i] * model.out_scale.col(node).array() + model.out_centre.col(node).array();
        const Sphere& rest = tree.rest[node];
        spheres[i] = {rest.c + delta.head<3>().matrix() + linear.col(i), std::max(rest.r + delta[3], 0.f)};
    }
}

float coordinate_ood_score(const Eigen::VectorXf& mean, const Eigen::MatrixXf& whitening,
                           Eigen::Ref<const Eigen::VectorXf> zn, Eigen::VectorXf& difference,
                           Eigen::VectorXf& whitened) noexcept {
    const auto m = static_cast<float>(mean.size());
    if (!(m > 0)) return 0;
    difference = zn - mean;
    whitened.noalias() = whitening * difference;
    return std::sqrt(whitened.squaredNorm() / m);
}

void check_nbd_model(const NbdModel& model, const SphereTree& tree, int vertex_count) {
    constexpr Requirement require("NBD-Tree");
    check_clustered_modes(model.modes, vertex_count);
    const int m = model.mode_count();
    require(model.z_centre.size() == m && model.z_scale.size() == m, "z_centre and z_scale have ",
            model.z_centre.size(), " and ", model.z_scale.size(), " entries instead of ", m);
    require(model.z_centre.allFinite() && model.z_scale.allFinite(),
            "the scaling of the modal coordinates is not finite");
    const std::size_t nodes = tree.nodes.size();
    require(model.networks.inputs() == m && static_cast<std::size_t>(model.networks.count()) == nodes, "has ",
            model.networks.count(), " networks of ", model.networks.inputs(), " inputs instead of ", nodes,
            " of ", m);
    for (const Eigen::MatrixXf* a : {&model.out_centre, &model.out_scale}) {
        require(a->rows() == NbdModel::outputs && static_cast<std::size_t>(a->cols()) == nodes,
                "the scaling of the outputs is ", a->rows(), " x ", a->cols(), " instead of ",
                NbdModel::outputs, " x ", nodes);
        require(a->allFinite(), "the scaling of the outputs is not finite");
    }
    const FixedMatrix& map = model.centre_map;
    require(map.size() == 0 || (map.rows() == m && static_cast<std::size_t>(map.cols()) == 3 * nodes),
            "the linear part of the centres is ", map.rows(), " x ", map.cols(), " instead of ", m, " x ",
            3 * nodes);
    require(map.all_finite(), "the linear part of the centres is not finite");
    require(model.z_mean.size() == model.z_whitening.rows() &&
                (model.z_mean.size() == 0 || model.z_mean.size() == m) &&
                model.z_whitening.cols() == model.z_whitening.rows(),
            "the spread of the modal coordinates has a mean of ", model.z_mean.size(), " numbers and ",
            model.z_whitening.rows(), " x ", model.z_whitening.cols(), " more, allowed: ", m, " and ", m,
            " x ", m, ", or none");
    require(model.z_mean.allFinite() && model.z_whitening.allFinite(),
            "the spread of the modal coordinates is not finite");
}

static_assert(NbdNetworks::max_at_once >= 2);

NbdBound::NbdBound(const SphereTree& tree, const NbdModel& model)
    : tree_(&tree),
      model_(&model),
      z_(Eigen::VectorXf::Zero(model.mode_count())),
      zn_(model.mode_count()),
      difference_(z_),
      whitened_(z_) {
    scratch_.fit(model.modes.X.rows());
    const std::vector<int>& representatives = model.modes.representatives;
    const int vertex_count = tree.vertices.empty() ? 0 : std::ranges::max(tree.vertices) + 1;
    std::vector<int> row_of(vertex_count, -1);
    for (std::size_t k = 0; k < representatives.size(); ++k)
        if (representatives[k] < vertex_count) row_of[representatives[k]] = k;
    for (const int v : tree.vertices) {
        seen_begin_.push_back(seen_.size());
        if (const int row = row_of[v]; row >= 0) seen_.push_back(row);
    }
    seen_begin_.push_back(seen_.size());
}

void NbdBound::begin_pose(VerticesRef x) noexcept {
    align_ = modal_coordinates(model_->modes, x, scratch_, z_);
    zn_.numbers() = (z_ - model_->z_centre).cwiseProduct(model_->z_scale);
    zn_.fix();
    pose_ood_score_ = -1;
    first_ = -1;
}

float NbdBound::ood_score(int node) noexcept {
    if (!(pose_ood_score_ >= 0))
        pose_ood_score_ =
            coordinate_ood_score(model_->z_mean, model_->z_whitening, zn_.numbers(), difference_, whitened_);
    return nbd_ood_score(pose_ood_score_, outside(node));
}

float NbdBound::outside(int node) const noexcept {
    const SphereTree::Node& n = tree_->nodes[node];
    const std::size_t begin = seen_begin_[n.vertex_begin], end = seen_begin_[n.vertex_end];
    float squared = last_.r * last_.r;
    for (const int row : std::span(seen_).subspan(begin, end - begin))
        squared = std::max(squared, (scratch_.x.row(row).transpose() - last_.c).squaredNorm());
    float outside = 0 * (last_.c.sum() + last_.r);  // NaN if the sphere is not finite
    if (squared > last_.r * last_.r) outside = std::sqrt(squared) / last_.r - 1;
    return outside;
}

}  // namespace nbd

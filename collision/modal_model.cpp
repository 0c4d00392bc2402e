#include "collision/modal_model.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "collision/message.hpp"

namespace nbd {
namespace {

/// Vector of a layer's outputs: 32, the paper's width, is known to the compiler; others up to the largest
/// width live on the stack too.
template <int Width>
using Layer = Eigen::Array<float, Width, 1, 0, Width == Eigen::Dynamic ? ModalModel::max_hidden : Width, 1>;

/// b + W x. W: [b.size(), x.size()], column-major. Reads W and b from `weights` and moves it past them.
template <int Width>
Layer<Width> dense_layer(const float*& weights, Eigen::Index width, const float* x,
                         Eigen::Index in) noexcept {
    using Column = Eigen::Map<const Layer<Width>>;
    const float* W = weights;
    weights += width * (in + 1);
    // Several sums run side by side, or each addition would wait for the one before.
    constexpr Eigen::Index lanes = 4;
    Layer<Width> sums[lanes] = {Column(W + width * in, width), Layer<Width>::Zero(width),
                                Layer<Width>::Zero(width), Layer<Width>::Zero(width)};
    const Eigen::Index whole = in - in % lanes;
    for (Eigen::Index i = 0; i < whole; i += lanes)
        for (Eigen::Index lane = 0; lane < lanes; ++lane)
            sums[lane] += Column(W + (i + lane) * width, width) * x[i + lane];
    for (Eigen::Index i = whole; i < in; ++i) sums[0] += Column(W + i * width, width) * x[i];
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

template <int Width>
Eigen::Array4f network(const float* weights, Eigen::Index hidden, const float* zn,
                       Eigen::Index modes) noexcept {
    const Layer<Width> h1 = dense_layer<Width>(weights, hidden, zn, modes).max(0.f);
    const Layer<Width> h2 = dense_layer<Width>(weights, hidden, h1.data(), hidden).max(0.f);
    return dense_layer<ModalModel::outputs>(weights, ModalModel::outputs, h2.data(), hidden);
}

template <class... Parts>
void require(bool ok, const Parts&... parts) {
    if (!ok) throw std::invalid_argument(message("modal tree: ", parts...));
}

}  // namespace

Sphere modal_sphere(const ModalModel& model, const SphereTree& tree, int node,
                    Eigen::Ref<const Eigen::VectorXf> zn) noexcept {
    const float* weights = model.weights.data() + static_cast<std::size_t>(node) *
                                                      static_cast<std::size_t>(model.weights_per_node());
    const int modes = model.mode_count();
    const Eigen::Array4f o = model.hidden == 32
                                 ? network<32>(weights, model.hidden, zn.data(), modes)
                                 : network<Eigen::Dynamic>(weights, model.hidden, zn.data(), modes);
    const Eigen::Array4f delta = o * model.out_scale.col(node).array() + model.out_centre.col(node).array();
    const Sphere& rest = tree.rest[static_cast<std::size_t>(node)];
    Eigen::Vector3f c = rest.c + delta.head<3>().matrix();
    if (model.centre_map.size() > 0)
        for (int axis = 0; axis < 3; ++axis) c[axis] += model.centre_map.col(3 * node + axis).dot(zn);
    return {c, std::max(0.f, rest.r + delta[3])};
}

void check_modal_model(const ModalModel& model, const SphereTree& tree, int vertex_count) {
    check_clustered_modes(model.modes, vertex_count);
    require(model.hidden >= 1 && model.hidden <= ModalModel::max_hidden, "hidden width ", model.hidden,
            ", allowed: 1 to ", ModalModel::max_hidden);
    const int m = model.mode_count();
    require(model.z_centre.size() == m && model.z_scale.size() == m, "z_centre and z_scale have ",
            model.z_centre.size(), " and ", model.z_scale.size(), " entries instead of ", m);
    require(model.z_centre.allFinite() && model.z_scale.allFinite(), "the scaling of the code is not finite");
    const std::size_t nodes = tree.nodes.size();
    require(model.weights.size() == nodes * static_cast<std::size_t>(model.weights_per_node()), "has ",
            model.weights.size(), " weights instead of ", model.weights_per_node(), " for each of ", nodes,
            " nodes");
    for (const Eigen::MatrixXf* a : {&model.out_centre, &model.out_scale}) {
        require(a->rows() == ModalModel::outputs && static_cast<std::size_t>(a->cols()) == nodes,
                "the scaling of the outputs is ", a->rows(), " x ", a->cols(), " instead of ",
                ModalModel::outputs, " x ", nodes);
        require(a->allFinite(), "the scaling of the outputs is not finite");
    }
    const Eigen::MatrixXf& map = model.centre_map;
    require(map.size() == 0 || (map.rows() == m && static_cast<std::size_t>(map.cols()) == 3 * nodes),
            "the linear part of the centres is ", map.rows(), " x ", map.cols(), " instead of ", m, " x ",
            3 * nodes);
    require(map.allFinite(), "the linear part of the centres is not finite");
    require(model.code_mean.size() == model.code_whitening.rows() &&
                (model.code_mean.size() == 0 || model.code_mean.size() == m) &&
                model.code_whitening.cols() == model.code_whitening.rows(),
            "the spread of the codes has a mean of ", model.code_mean.size(), " numbers and ",
            model.code_whitening.rows(), " x ", model.code_whitening.cols(), " more, allowed: ", m, " and ",
            m, " x ", m, ", or none");
    require(model.code_mean.allFinite() && model.code_whitening.allFinite(),
            "the spread of the codes is not finite");
    const auto bad = std::ranges::find_if_not(model.weights, [](float w) { return std::isfinite(w); });
    require(bad == model.weights.end(), "a weight of node ",
            (bad - model.weights.begin()) / model.weights_per_node(), " is not finite");
}

}  // namespace nbd

#include "training/files/surface_body.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "collision/base/notice.hpp"

namespace nbd {

namespace {

void require_fit(const char* what, Eigen::Index rows, Eigen::Index cols, Eigen::Index allowed_rows,
                 Eigen::Index allowed_cols) {
    if (rows != allowed_rows || cols != allowed_cols)
        throw std::invalid_argument(fmt::format("{} are {} x {}, but the body needs {} x {}", what, rows,
                                                cols, allowed_rows, allowed_cols));
}

}  // namespace

SurfaceBody make_surface_body(VerticesRef X, FacesRef F, const SurfaceEmbedding& W,
                              Eigen::Ref<const Eigen::MatrixXf> node_modes, std::string hash) {
    const Eigen::Index n = X.rows(), m = node_modes.cols();
    require_fit("embedding weights", W.rows(), W.cols(), n, W.cols());
    require_fit("node modes", node_modes.rows(), m, 3 * W.cols(), m);
    if (!X.allFinite()) throw std::invalid_argument("a rest position is not finite");
    if (!node_modes.allFinite()) throw std::invalid_argument("an entry of the modes is not finite");
    SurfaceBody body{.X = X, .F = F, .W = W, .U = ModeRows::Zero(3 * n, m), .hash = std::move(hash)};
    body.W.makeCompressed();
    for (Eigen::Index v = 0; v < n; ++v)
        for (SurfaceEmbedding::InnerIterator entry(body.W, v); entry; ++entry)
            body.U.middleRows<3>(3 * v) += entry.value() * node_modes.middleRows<3>(3 * entry.col());
    return body;
}

void hang_on_solid(CollisionTree& tree, const SurfaceBody& body) {
    tree.affine.reset();
    if (body.solid.X.rows() == 0) return;
    try {
        hang_on_nodes(tree, body.W, body.solid.X.cast<float>());
    } catch (const std::invalid_argument& error) {
        notice(fmt::format("no affine bounds: {}", error.what()));
    }
}

}  // namespace nbd

#include "sim/contact/contact_surface.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

namespace nbd {

ContactSurface::ContactSurface(Embedding W, Faces F, NodesRef X) : W_(std::move(W)), F_(std::move(F)) {
    if (W_.cols() != X.rows() || W_.rows() == 0 || F_.rows() == 0)
        throw std::invalid_argument(
            fmt::format("contact surface: an embedding [{}, {}] and {} faces do not fit a body of {} nodes",
                        W_.rows(), W_.cols(), F_.rows(), X.rows()));
    W_.makeCompressed();
    topology_ = surface_topology(F_, vertex_count());
    update(X);
    rest_areas_ = vertex_areas(F_, x_);
    rest_diagonal_ = (x_.colwise().maxCoeff() - x_.colwise().minCoeff()).norm();
}

void ContactSurface::update(NodesRef nodes) {
    apply_embedding(W_, nodes, x_);
    x_float_ = x_.cast<float>();
    face_boxes_.resize(static_cast<std::size_t>(F_.rows()));
    box_ = empty_box();
    for (Eigen::Index f = 0; f < F_.rows(); ++f) {
        const Box box =
            bounding_box({x_float_.row(F_(f, 0)), x_float_.row(F_(f, 1)), x_float_.row(F_(f, 2))});
        face_boxes_[static_cast<std::size_t>(f)] = box;
        box_ = joined(box_, box);
    }
}

}  // namespace nbd

#include "collision/continuous/moving_body.hpp"

#include <cmath>
#include <stdexcept>

#include "collision/base/message.hpp"

namespace nbd {
namespace {

void require_positions(const char* name, NodesRef x, Eigen::Index vertices) {
    if (x.rows() != vertices)
        throw std::invalid_argument(
            message(name, " has ", x.rows(), " positions, but the surface has ", vertices, " vertices"));
    for (Eigen::Index v = 0; v < x.rows(); ++v)
        if (!x.row(v).allFinite())
            throw std::invalid_argument(message(name, ": position of vertex ", v, " is not finite"));
}

std::shared_ptr<const CollisionTree> tree_of(NodesRef X, FacesRef F) {
    if (F.rows() == 0) throw std::invalid_argument("the surface has no faces");
    require_positions("X", X, X.rows());
    const Eigen::RowVector3d low = X.colwise().minCoeff(), high = X.colwise().maxCoeff();
    const double size = (high / 2 - low / 2).maxCoeff();
    const Eigen::RowVector3d centre = low / 2 + high / 2;
    const Nodes about = X.rowwise() - centre;
    return shared_exact_tree((size > 0 ? Nodes(about / size) : about).cast<float>(), F);
}

}  // namespace

MovingBody::MovingBody(NodesRef X, FacesRef F, BodyRole role)
    : role_(role),
      F_(F),
      features_(surface_features(F, X.rows())),
      begin_(X),
      end_(X),
      tree_(tree_of(X, F), BoundKind::boxes),
      own_tree_(refer_to(tree_.tree()), BoundKind::boxes) {
    if (!is_obstacle()) neighbours_ = neighbour_features(F_, features_, 0);
}

void MovingBody::move(NodesRef begin, NodesRef end) {
    require_positions("begin", begin, begin_.rows());
    require_positions("end", end, begin_.rows());
    begin_ = begin;
    end_ = end;
}

void MovingBody::make_local(Local& local, const Eigen::RowVector3d& origin, double scale,
                            bool with_motion) const {
    local.begin = (begin_.rowwise() - origin) * scale;
    local.end = (end_.rowwise() - origin) * scale;
    if (with_motion) {
        const Eigen::RowVector3d motion = (local.end - local.begin).colwise().mean();
        local.end.rowwise() -= motion;
    }
    local.begin_float = local.begin.cast<float>();
    local.end_float = local.end.cast<float>();
    local.rounding =
        0x1p-24 * std::max(local.begin.cwiseAbs().maxCoeff(), local.end.cwiseAbs().maxCoeff()) + 0x1p-149;
}

}  // namespace nbd

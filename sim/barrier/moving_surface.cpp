#include "sim/barrier/moving_surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace nbd {

MovingSurface::MovingSurface(const Faces& F, Nodes rest, int body)
    : body_(body),
      F_(F),
      topology_(surface_topology(F, rest.rows())),
      rest_(std::move(rest)),
      areas_(vertex_areas(F_, rest_)),
      tree_(shared_exact_tree(rest_.cast<float>(), F_), BoundKind::boxes),
      own_tree_(refer_to(tree_.tree()), BoundKind::boxes) {
    move(rest_, rest_);
}

void MovingSurface::move(Nodes begin, Nodes end) {
    begin_ = std::move(begin);
    end_ = std::move(end);
    begin_float_ = begin_.cast<float>();
    end_float_ = end_.cast<float>();
    tree_.begin_step(begin_float_, end_float_);
    if (is_obstacle()) return;
    mean_motion_ = (end_ - begin_).colwise().mean().transpose();
    own_end_float_ = (end_.rowwise() - mean_motion_.transpose()).cast<float>();
    own_tree_.begin_step(begin_float_, own_end_float_);
}

double MovingSurface::rounding() const noexcept {
    return 0x1p-24 * std::sqrt(3.0) * std::max(begin_.cwiseAbs().maxCoeff(), end_.cwiseAbs().maxCoeff());
}

std::array<FeatureCorner, 4> corners(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces) {
    const auto numbered = [&](int surface) { return surfaces[surface].numbered(surface); };
    const auto vertices = feature_vertices(pair, numbered(pair.surface_a), numbered(pair.surface_b));
    std::array<FeatureCorner, 4> result;
    for (std::size_t k = 0; k < 4; ++k)
        result[k] = {k < corners_of_a(pair.kind) ? pair.surface_a : pair.surface_b, vertices[k]};
    return result;
}

}  // namespace nbd

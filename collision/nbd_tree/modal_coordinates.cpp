#include "collision/nbd_tree/modal_coordinates.hpp"

#include <cmath>
#include <stdexcept>

#include "collision/base/message.hpp"

namespace nbd {

RigidTransform modal_coordinates(const ClusteredModes& modes, VerticesRef x, ModalCoordinatesScratch& scratch,
                                 Eigen::Ref<Eigen::VectorXf> z) noexcept {
    const Eigen::Index k = modes.X.rows();
    scratch.fit(k);
    for (Eigen::Index i = 0; i < k; ++i) scratch.x.row(i) = x.row(modes.representatives[i]);
    const RigidTransform align = match_shape(modes.X, scratch.x, modes.w);
    auto d = scratch.d.numbers();
    for (Eigen::Index i = 0; i < k; ++i) {
        const Eigen::Vector3f y = align.R.transpose() * (scratch.x.row(i).transpose() - align.t);
        d.segment<3>(3 * i) = modes.w[i] * (y - modes.X.row(i).transpose());
    }
    scratch.d.fix();
    modes.U.transposed_times(scratch.d, z);
    return align;
}

void check_clustered_modes(const ClusteredModes& modes, int vertex_count) {
    const Eigen::Index k = modes.representatives.size();
    if (k == 0) throw std::invalid_argument("modes: no representative vertices");
    for (const int v : modes.representatives)
        if (v < 0 || v >= vertex_count)
            throw std::invalid_argument(message("modes: representative vertex ", v, ", but the surface has ",
                                                vertex_count, " vertices"));
    if (modes.w.size() != k || modes.X.rows() != k || modes.U.rows() != 3 * k)
        throw std::invalid_argument(message("modes: ", k, " representatives, but ", modes.w.size(),
                                            " weights, ", modes.X.rows(), " rest positions and ",
                                            modes.U.rows(), " rows of U instead of ", 3 * k));
    if (modes.U.cols() == 0) throw std::invalid_argument("modes: U has no columns");
    if (!modes.X.allFinite() || !modes.U.all_finite())
        throw std::invalid_argument("modes: a rest position or an entry of U is not finite");
    for (Eigen::Index i = 0; i < k; ++i)
        if (!(modes.w[i] > 0 && std::isfinite(modes.w[i])))
            throw std::invalid_argument(
                message("modes: weight ", i, " is ", modes.w[i], ", allowed: finite and above 0"));
}

}  // namespace nbd

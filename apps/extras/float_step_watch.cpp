#include "apps/extras/float_step_watch.hpp"

#include <fmt/format.h>

#include <utility>

#include "collision/base/notice.hpp"
#include "collision/geometry/far_origin.hpp"

namespace nbd {

FloatStepWatch::FloatStepWatch(std::string name, double edge) : name_(std::move(name)), edge_(edge) {}

void FloatStepWatch::see(VerticesRef x) {
    if (has_told_ || x.rows() == 0) return;
    const double farthest = x.cwiseAbs().maxCoeff(), step = float_step(farthest);
    if (!(1000 * step > edge_)) return;
    has_told_ = true;
    notice(
        fmt::format("{} is {:.4g} m away from the recording's origin, where positions are rounded to {:.2g} "
                    "m, more than a thousandth of its mean edge ({:.2g} m): its recorded shape is coarse; "
                    "record far parts of a scene apart",
                    name_, farthest, step, edge_));
}

}  // namespace nbd

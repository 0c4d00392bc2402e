#include "sim/world/secant.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <utility>

namespace nbd {

Eigen::VectorXd Secant::way_from(const Eigen::VectorXd& off) {
    const Eigen::VectorXd before = std::exchange(off_, off);
    ++tries_;
    if (tries_ == 2) {  // each by its own secant
        for (Eigen::Index k = 0; k < way_.size(); ++k)
            if (way_[k] != 0) response_(k, k) = std::max(1.0, (off[k] - before[k]) / way_[k]);
    } else if (tries_ > 2 && way_.squaredNorm() > 0) {  // [Broyden65]
        response_ += (off - before - response_ * way_) * way_.transpose() / way_.squaredNorm();
    }
    way_ = -response_.partialPivLu().solve(off);
    return way_;
}

}  // namespace nbd

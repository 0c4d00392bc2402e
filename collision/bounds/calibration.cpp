#include "collision/bounds/calibration.hpp"

#include <cmath>
#include <string>

#include "collision/base/message.hpp"

namespace nbd {

void check_calibration(const Calibration& calibration, std::string_view bounds, std::size_t nodes) {
    const std::string subject = message("calibration of ", bounds, " bounds");
    const Requirement require(subject);
    const auto require_share = [&](const char* what, double share) {
        require(share > 0 && share < 1, what, " is ", share, ", allowed: above 0 and below 1");
    };
    require_share("miss rate", calibration.miss_rate);
    require_share("confidence", calibration.confidence);
    require(calibration.trajectories >= 1 && calibration.poses >= calibration.trajectories, "made from ",
            calibration.poses, " poses of ", calibration.trajectories,
            " trajectories, allowed: at least 1 trajectory, with at least 1 pose each");
    require(calibration.margins.size() == nodes, "has ", calibration.margins.size(), " margins for ", nodes,
            " nodes");
    for (std::size_t i = 0; i < nodes; ++i)
        require(std::isfinite(calibration.margins[i]) && calibration.margins[i] >= 0, "margin of node ", i,
                " is ", calibration.margins[i], ", allowed: finite and 0 or more");
    require(calibration.limits.empty() || calibration.limits.size() == nodes, "has ",
            calibration.limits.size(), " score limits for ", nodes, " nodes");
    for (std::size_t i = 0; i < calibration.limits.size(); ++i)
        require(std::isfinite(calibration.limits[i]) && calibration.limits[i] >= 0, "score limit of node ", i,
                " is ", calibration.limits[i], ", allowed: finite and 0 or more");
}

}  // namespace nbd

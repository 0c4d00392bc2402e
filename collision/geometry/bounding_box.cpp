#include "collision/geometry/bounding_box.hpp"

#include <algorithm>
#include <limits>

namespace nbd {

Box bounding_box(const Positions& x, std::span<const int> vertices) noexcept {
    // Four independent chains, since each minimum waits for the previous one.
    constexpr int chains = 4;
    Box part[chains] = {empty_box(), empty_box(), empty_box(), empty_box()};
    Eigen::Array4f doubt[chains] = {};  // NaN where a number is not finite: minima lose it
    for (Eigen::Array4f& d : doubt) d.setZero();
    const auto add = [&](int c, int vertex) {
        const Eigen::Array4f p = x[vertex];
        part[c].lo = part[c].lo.min(p);
        part[c].hi = part[c].hi.max(p);
        doubt[c] += 0 * p;
    };
    const int *begin = vertices.data(), *end = begin + vertices.size();
    for (; end - begin >= chains; begin += chains)
        for (int c = 0; c < chains; ++c) add(c, begin[c]);
    for (; begin < end; ++begin) add(0, *begin);
    Box box = joined(joined(part[0], part[1]), joined(part[2], part[3]));
    const Eigen::Array4f any = (doubt[0] + doubt[1]) + (doubt[2] + doubt[3]);
    box.lo += any;
    box.hi += any;
    box.lo[3] = box.hi[3] = 0;
    return box;
}

Sphere sphere_around(const Box& box) noexcept {
    // The centre and the half diagonal round by a few ulp; for the centre these are ulp of coordinates, which
    // may be large compared with the box.
    constexpr float ulp = std::numeric_limits<float>::epsilon();
    const Eigen::Array4f centre = (box.lo + box.hi) / 2, half = (box.hi - centre).max(centre - box.lo);
    const float far = std::max(box.lo.abs().maxCoeff(), box.hi.abs().maxCoeff());
    return {centre.head<3>().matrix(), half.matrix().norm() * (1 + 4 * ulp) + 2 * ulp * far};
}

}  // namespace nbd

#pragma once

#include <vector>

#include "collision/bounds/certified/region_motion.hpp"

namespace nbd::python {

/// Motions of the regions of a tree's certified bounds in one pose. Does not change.
struct RegionMotions {
    std::vector<RegionMotion> all;
};

}  // namespace nbd::python

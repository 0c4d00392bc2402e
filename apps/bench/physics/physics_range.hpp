#pragma once

#include <functional>
#include <initializer_list>
#include <string>
#include <vector>

#include "apps/bench/physics/physics_check.hpp"

namespace nbd {

/// Values that are combined with each other. The defaults are the range that every check is held to.
struct PhysicsRange {
    std::vector<double> sizes{0.01, 0.1, 1, 10};
    std::vector<double> steps{1e-4, 1e-3, 5e-3, 2e-2};
    std::vector<double> moduli{1e4, 1e6, 1e9};
    std::vector<bool> modes{false, true};  // intersection_free
    std::vector<bool> far{false, true};    // with a far body
    std::vector<std::string> variants{{}};
    std::vector<double> parameters{std::numeric_limits<double>::quiet_NaN()};
};

/// For PhysicsRange::far of checks that take long: a far body in one case of five only.
inline const std::vector<bool> far_in_some{};

/// All combinations that `allowed` accepts (null: all). One in `thinning` of them is quick.
std::vector<PhysicsCase> all_cases(const PhysicsRange& range, int thinning,
                                   const std::function<bool(const PhysicsCase&)>& allowed = {});

/// Whether the own weight of a block of this size and of 1000 kg/m3 shortens it by no more than `share`.
bool carries_itself(const PhysicsCase& c, double share = 0.1);

}  // namespace nbd

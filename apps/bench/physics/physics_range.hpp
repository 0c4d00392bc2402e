#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "apps/bench/physics/physics_check.hpp"

namespace nbd {

/// In which cases a far body flies by: in none, in one of five (for checks that take long), or in each as
/// well as not.
enum class FarBody { none, some, each };

/// Values that are combined with each other. The defaults are the range that every check is held to.
struct PhysicsRange {
    std::vector<double> sizes{0.01, 0.1, 1, 10};
    std::vector<double> steps{1e-4, 1e-3, 5e-3, 2e-2};
    std::vector<double> moduli{1e4, 1e6, 1e9};
    std::vector<bool> modes{false, true};  // intersection_free
    FarBody far = FarBody::each;
    std::vector<std::string> variants{{}};
    std::vector<double> parameters{std::numeric_limits<double>::quiet_NaN()};
};

// Parts of the range, for checks that take long.
inline const std::vector<double> steps_from_1_ms{1e-3, 5e-3, 2e-2};
inline const std::vector<double> three_sizes{0.01, 0.1, 10};

/// All combinations that `allowed` accepts (null: all). One in `thinning` of them is quick.
std::vector<PhysicsCase> all_cases(const PhysicsRange& range, int thinning,
                                   const std::function<bool(const PhysicsCase&)>& allowed = {});

/// Whether the own weight of a block of this size and of 1000 kg/m3 shortens it by no more than `share`.
bool carries_itself(const PhysicsCase& c, double share = 0.1);

}  // namespace nbd

#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace nbd {

/// One point of the range over which a check runs.
struct PhysicsCase {
    double size = 0.2;      // of the body, metres; what it measures is the check's
    double dt = 5e-3;       // seconds
    double young = 1e5;     // Pa
    bool far_body = false;  // a body a hundred times larger flies by at 100 m/s
    std::string variant{};  // what else differs, for example a law of elasticity; empty: nothing
    double parameter = std::numeric_limits<double>::quiet_NaN();  // of the check; NaN: it has none
    bool quick = false;                                           // also in the thinned range
};

/// What a check found at one point.
struct PhysicsOutcome {
    double value = 0, truth = 0;
    double error = 0;  // as the check's `allowed` counts it; infinite where a step failed, NaN counts as that
    std::string note{};  // empty, or one line
};

/// A law of motion that must hold over the whole range: a row of a table of checks.
struct PhysicsCheck {
    std::string name;      // on the command line
    std::string truth;     // one sentence with the formula and its source
    std::string quantity;  // of value and truth, with its unit
    double allowed = 0;    // largest error
    std::vector<PhysicsCase> cases;
    std::function<PhysicsOutcome(const PhysicsCase&)> run;  // may throw; may be called by several threads
    std::string parameter{};                                // what PhysicsCase::parameter is; empty: not used
    int section = 0;                                        // of the page; physics_checks() sets it
};

/// In which cases a far body flies by: in none, in one of five (for checks that take long), or in each as
/// well as not.
enum class FarBody { none, some, each };

/// Values that are combined with each other. The defaults are the range that every check is held to.
struct PhysicsRange {
    std::vector<double> sizes{0.01, 0.1, 1, 10};
    std::vector<double> steps{1e-4, 1e-3, 5e-3, 2e-2};
    std::vector<double> moduli{1e4, 1e6, 1e9};
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

/// Accepts cases in which the own weight of a block of the case's size and of 1000 kg/m3 shortens it by no
/// more than `share`.
std::function<bool(const PhysicsCase&)> carries_itself(double share = 0.1);

/// |value - truth| over |truth|.
PhysicsOutcome relative_outcome(double value, double truth);

/// Of a value that is to be 0: the error is its size.
PhysicsOutcome zero_outcome(double value);

// The checks of one kind each.
std::vector<PhysicsCheck> free_motion_checks();
std::vector<PhysicsCheck> collision_checks();
std::vector<PhysicsCheck> friction_checks();
std::vector<PhysicsCheck> rest_checks();
std::vector<PhysicsCheck> turning_checks();
std::vector<PhysicsCheck> joined_checks();
std::vector<PhysicsCheck> load_checks();
std::vector<PhysicsCheck> impact_checks();
std::vector<PhysicsCheck> ringing_checks();
std::vector<PhysicsCheck> stiffness_checks();
std::vector<PhysicsCheck> static_checks();
std::vector<PhysicsCheck> told_checks();
std::vector<PhysicsCheck> thread_checks();

/// All checks, in the order of the page.
std::vector<PhysicsCheck> physics_checks();

}  // namespace nbd

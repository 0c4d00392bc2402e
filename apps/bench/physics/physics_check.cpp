#include "apps/bench/physics/physics_check.hpp"

#include <cmath>
#include <utility>

namespace nbd {

PhysicsOutcome relative_outcome(double value, double truth) {
    return {.value = value, .truth = truth, .error = std::abs(value - truth) / std::abs(truth)};
}

PhysicsOutcome zero_outcome(double value) { return {.value = value, .truth = 0, .error = std::abs(value)}; }

std::vector<PhysicsCase> all_cases(const PhysicsRange& range, int thinning,
                                   const std::function<bool(const PhysicsCase&)>& allowed) {
    std::vector<PhysicsCase> cases;
    const auto add = [&](PhysicsCase c) {
        if (allowed && !allowed(c)) return;
        c.quick = cases.size() % thinning == 0;
        cases.push_back(std::move(c));
    };
    const std::vector<bool> far =
        range.far == FarBody::each ? std::vector<bool>{false, true} : std::vector<bool>{false};
    for (const double size : range.sizes)
        for (const double dt : range.steps)
            for (const double young : range.moduli)
                for (const bool is_far : far)
                    for (const std::string& variant : range.variants)
                        for (const double parameter : range.parameters)
                            add({.size = size,
                                 .dt = dt,
                                 .young = young,
                                 .far_body = is_far,
                                 .variant = variant,
                                 .parameter = parameter});
    if (range.far == FarBody::some)
        for (std::size_t k = 0, alone = cases.size(); k < alone; k += 5) {
            PhysicsCase c = cases[k];
            c.far_body = true;
            add(std::move(c));
        }
    return cases;
}

std::function<bool(const PhysicsCase&)> carries_itself(double share) {
    constexpr double g = 9.81, density = 1000;
    return [share](const PhysicsCase& c) { return density * g * c.size / c.young <= share; };
}

std::vector<PhysicsCheck> physics_checks() {
    const std::pair<int, std::vector<PhysicsCheck> (*)()> groups[]{
        {1, free_motion_checks}, {1, collision_checks}, {2, friction_checks}, {2, rest_checks},
        {2, turning_checks},     {1, joined_checks},    {1, load_checks},     {3, impact_checks},
        {1, ringing_checks},     {4, stiffness_checks}, {4, static_checks},   {5, told_checks},
        {1, thread_checks}};
    std::vector<PhysicsCheck> all;
    for (const auto& [section, checks_of] : groups)
        for (PhysicsCheck& check : checks_of()) {
            check.section = section;
            all.push_back(std::move(check));
        }
    return all;
}

}  // namespace nbd

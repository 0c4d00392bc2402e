#include "sim/contact/pair_rules.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace nbd {

void PairRules::set(int a, int b, const PairRule& rule) {
    if (a < 0 && b < 0) throw std::invalid_argument("pair: two obstacles never meet; name a body");
    if (rule.friction && !(*rule.friction >= 0 && std::isfinite(*rule.friction)))
        throw std::invalid_argument(
            fmt::format("pair: friction is {}, allowed: finite and >= 0", *rule.friction));
    rules_[std::minmax(a, b)] = rule;
}

PairRule PairRules::of(int a, int b) const noexcept {
    const PairRule* rule = find(a, b);
    return rule ? *rule : PairRule{};
}

bool PairRules::meet(int a, int b) const noexcept {
    if (a < 0 && b < 0) return false;
    const PairRule* rule = find(a, b);
    return !rule || rule->meets;
}

double PairRules::friction(int a, int b, double usual) const noexcept {
    const PairRule* rule = find(a, b);
    return rule ? rule->friction.value_or(usual) : usual;
}

const PairRule* PairRules::find(int a, int b) const noexcept {
    if (rules_.empty()) return nullptr;
    const auto found = rules_.find(std::minmax(a, b));
    return found == rules_.end() ? nullptr : &found->second;
}

}  // namespace nbd

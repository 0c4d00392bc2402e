#pragma once

#include <map>
#include <optional>
#include <utility>

namespace nbd {

/// What holds between two surfaces that come near each other.
struct PairRule {
    bool meets = true;                 // false: they pass through each other
    std::optional<double> friction{};  // Coulomb's coefficient, >= 0; none: as without the rule
};

/// The number by which rules and contacts know an obstacle, beside the bodies 0, 1, ...
constexpr int party_of_obstacle(int obstacle) noexcept { return -1 - obstacle; }

/// Rules for pairs of bodies, for bodies and obstacles, and for a body and itself. All other pairs meet,
/// except obstacles among themselves. What does not meet is not searched, does not press, and does not count
/// as intersecting.
class PairRules {
 public:
    /// a, b: bodies, 0, 1, ..., or obstacles, see party_of_obstacle(), in any order. Replaces an earlier rule
    /// for the pair. Throws std::invalid_argument for two obstacles, or friction that is negative or not
    /// finite.
    void set(int a, int b, const PairRule& rule);

    /// That of a pair; the default where there is none.
    PairRule of(int a, int b) const noexcept;
    bool meet(int a, int b) const noexcept;
    /// Coulomb's coefficient of a pair; `usual` where no rule gives one.
    double friction(int a, int b, double usual) const noexcept;

 private:
    const PairRule* find(int a, int b) const noexcept;

    std::map<std::pair<int, int>, PairRule> rules_;  // by the smaller number, then the larger
};

}  // namespace nbd

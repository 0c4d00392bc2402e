#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace nbd {

/// What the body goes through in a training trajectory: a fall to the floor; pulls and pokes; two hands that
/// bend, twist and stretch; a second copy thrown at it; release from a stretched, sheared and spinning start.
enum class RecipeKind { drop, forces, grips, thrown, free };
inline constexpr std::array<const char*, 5> recipe_kind_names{"drop", "forces", "grips", "thrown", "free"};

/// Numbers are drawn uniformly from [from, to].
struct Range {
    double from = 0, to = 0;
    bool operator==(const Range&) const = default;
};

/// One kind of trajectory in the mix.
struct KindRanges {
    double weight = 1;  // how often, relative to the other kinds; >= 0
    Range gradient;     // strain that the velocity gradient of the start runs into
    double forces = 0;  // number of patch forces, relative to that of the kind `forces`; >= 0
    bool operator==(const KindRanges&) const = default;
};

/// From what recipes are drawn: what a recipe file says. Lengths are in diagonals of the body's box, times in
/// those that sound takes to cross it, speeds in that of sound; see NaturalScales. The defaults suit any
/// closed body.
struct RecipeRanges {
    double strength = 1;  // of everything, > 0; 1 gives local strains of 20 to 50 %
    std::optional<double>
        contact_share{};  // of drop and thrown in the mix, in [0, 1]; else as the weights say
    std::array<KindRanges, 5> kinds{{{1, {0.02, 0.08}, 0.5},  // in the order of RecipeKind
                                     {1, {0.02, 0.10}, 1},
                                     {1, {0.01, 0.05}, 0.3},
                                     {1, {0.01, 0.05}, 0.2},
                                     {1, {0.2, 0.4}, 0.6}}};
    Range warm_up{0.4, 0.8};  // time before the first frame

    struct Force {  // a pull or poke at a patch of nodes
        Range strain{0.2, 0.6}, radius{0.12, 0.25}, duration{1.5, 4};
        double balanced = 0.5;  // share of them with the opposite force elsewhere, in [0, 1]
        bool operator==(const Force&) const = default;
    } force{};
    struct Floor {
        Range gap{0.015, 0.04};                        // below the body at the start
        Range sag{0.02, 0.06}, fall_speed{0.1, 0.25};  // strain by its weight; of a drop
        double under_thrown = 0.5;  // share of the kind `thrown` that has a floor, in [0, 1]
        bool operator==(const Floor&) const = default;
    } floor{};
    struct Hands {
        Range share{0.1, 0.2};                                   // of the body, each
        Range twist{-0.9, 0.9}, bend{-0.5, 0.5};                 // radians, each
        Range stretch{-0.12, 0.15}, shear{-0.15, 0.15};          // of the body's length
        Range start{0, 0.1}, duration{2, 6}, release{0.5, 1.2};  // start, release: of the trajectory
        bool operator==(const Hands&) const = default;
    } hands{};
    struct Thrown {
        Range speed{0.15, 0.35}, aside{0, 0.2};
        bool operator==(const Thrown&) const = default;
    } thrown{};

    bool operator==(const RecipeRanges&) const = default;
};

/// Reads a recipe file's JSON text; what it leaves out keeps its default. Throws std::invalid_argument, one
/// line: the JSON path, what it holds and what was allowed; an unknown key names the nearest known one.
RecipeRanges parse_recipe_ranges(std::string_view text);

/// The whole of it as a recipe file.
std::string to_json(const RecipeRanges& ranges);

/// Share of each kind in the mix; they sum to 1. Throws std::invalid_argument where the weights do not allow
/// the contact share, or are all zero.
std::array<double, 5> recipe_mix(const RecipeRanges& ranges);

}  // namespace nbd

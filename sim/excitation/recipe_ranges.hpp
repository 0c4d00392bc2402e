#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace nbd {

/// Kinds of training trajectories. drop: a fall to the floor. forces: pulls and pokes. grips: two hands that
/// bend, twist and stretch. thrown: a second copy is thrown at the body. free: release from a stretched,
/// sheared and spinning start. fold: two hands bring the ends together. squash: two plates press the body
/// flat. curl: tips are drawn towards the middle. The last three bring a body near itself.
enum class RecipeKind { drop, forces, grips, thrown, free, fold, squash, curl };
inline constexpr std::size_t recipe_kinds = 8;
inline constexpr std::array<const char*, recipe_kinds> recipe_kind_names{"drop", "forces", "grips",  "thrown",
                                                                         "free", "fold",   "squash", "curl"};

/// Range of numbers that are drawn uniformly from [from, to].
struct Range {
    double from = 0, to = 0;
    bool operator==(const Range&) const = default;
};

/// One kind of trajectory in the mix.
struct KindRanges {
    double weight = 1;  // frequency relative to the other kinds; >= 0
    Range gradient;     // strain that the initial velocity gradient causes
    double forces = 0;  // number of patch forces relative to the kind `forces`; >= 0
    bool operator==(const KindRanges&) const = default;
};

/// Ranges from which recipes are drawn, as in a recipe file. Lengths are in diagonals of the body's box,
/// times in the time that sound takes to cross it, speeds in the speed of sound; see NaturalScales. The
/// defaults suit any closed body.
struct RecipeRanges {
    double strength = 1;  // scale of everything, > 0; 1 gives local strains of 20 to 50 %
    std::optional<double>
        contact_share{};  // share of drop, thrown and squash in the mix, in [0, 1]; nullopt: by the weights
    std::array<KindRanges, recipe_kinds> kinds{{{1, {0.02, 0.08}, 0.5},  // in the order of RecipeKind
                                                {1, {0.02, 0.10}, 1},
                                                {1, {0.01, 0.05}, 0.3},
                                                {1, {0.01, 0.05}, 0.2},
                                                {1, {0.2, 0.4}, 0.6},
                                                {0, {0.01, 0.05}, 0.1},
                                                {0, {0.01, 0.05}, 0.1},
                                                {0, {0.01, 0.05}, 0.1}}};
    Range warm_up{0.4, 0.8};  // time before the first frame

    struct Force {  // a pull or poke at a patch of nodes
        Range strain{0.2, 0.6}, radius{0.12, 0.25}, duration{1.5, 4};
        double balanced = 0.5;  // share of the forces balanced by an opposite force elsewhere, in [0, 1]
        bool operator==(const Force&) const = default;
    } force{};
    struct Floor {
        Range gap{0.015, 0.04};                        // distance below the body at the start
        Range sag{0.02, 0.06}, fall_speed{0.1, 0.25};  // sag: strain by the body's weight
        double under_thrown = 0.5;                     // share of the kind `thrown` with a floor, in [0, 1]
        bool operator==(const Floor&) const = default;
    } floor{};
    struct Hands {
        Range share{0.1, 0.2};                           // share of the body's length held by each hand
        Range twist{-0.9, 0.9}, bend{-0.5, 0.5};         // radians, per hand
        Range stretch{-0.12, 0.15}, shear{-0.15, 0.15};  // relative to the body's length
        Range start{0, 0.1}, duration{2, 6}, release{0.5, 1.2};  // start, release: relative to the trajectory
        bool operator==(const Hands&) const = default;
    } hands{};
    struct Thrown {
        Range speed{0.15, 0.35}, aside{0, 0.2};
        bool operator==(const Thrown&) const = default;
    } thrown{};

    struct Fold {
        Range share{0.1, 0.2};                  // share of the body's length held by each hand
        Range angle{0.9, 1.5}, duration{4, 8};  // angle: radians, per hand
        bool operator==(const Fold&) const = default;
    } fold{};
    struct Squash {
        Range share{0.3, 0.6}, duration{3, 7};  // share: of the body's height that the plates take away
        bool operator==(const Squash&) const = default;
    } squash{};
    struct Curl {
        Range tips{2, 6}, radius{0.03, 0.06};   // tips: number of them
        Range close{0.4, 0.8}, duration{4, 8};  // close: share of a tip's way to the middle
        bool operator==(const Curl&) const = default;
    } curl{};

    bool operator==(const RecipeRanges&) const = default;
};

/// Reads the JSON text of a recipe file; missing keys keep their defaults. Throws a one-line
/// std::invalid_argument with the JSON path, its value and what was allowed; for an unknown key, the nearest
/// known one.
RecipeRanges parse_recipe_ranges(std::string_view text);

/// parse_recipe_ranges() of the file at `path`. Throws std::runtime_error; the message starts with the path.
RecipeRanges load_recipe_ranges(const std::filesystem::path& path);

/// All ranges as JSON text of a recipe file.
std::string to_json(const RecipeRanges& ranges);

/// Share of each kind in the mix; the shares sum to 1. Throws std::invalid_argument if all weights are zero
/// or the weights do not allow the contact share.
std::array<double, recipe_kinds> recipe_mix(const RecipeRanges& ranges);

}  // namespace nbd

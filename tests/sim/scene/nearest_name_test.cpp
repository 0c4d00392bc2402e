#include "sim/json/nearest_name.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace nbd {
namespace {

const std::vector<std::string> known{"exact",  "boxes", "bd", "nbd", "velocity", "stable_neo_hookean",
                                     "--nodes"};

/// A word with one wrong letter in three, or the end of a name; what others call our keys; other words.
TEST(NearestName, IsTheOneThatAWordMayMean) {
    for (const auto& [word, name] : {std::pair("boxs", "boxes"),
                                     {"bb", "bd"},
                                     {"velosityy", "velocity"},
                                     {"--nods", "--nodes"},
                                     {"neo_hookean", "stable_neo_hookean"},
                                     {"", ""},
                                     {"--", ""},
                                     {"tight", ""},
                                     {"spheres", ""},
                                     {"--cage", ""},
                                     {"foo", ""},
                                     {"zz", ""},
                                     {"no", ""}})
        EXPECT_EQ(nearest_name(word, known), name) << word;
    const std::vector<std::string> keys{"law", "young", "poisson", "density", "rayleigh_mass", "--density"};
    for (const auto& [word, name] : {std::pair("E", "young"),
                                     {"youngs_modulus", "young"},
                                     {"young_modulus", "young"},
                                     {"nu", "poisson"},
                                     {"rho", "density"},
                                     {"--rho", "--density"},
                                     {"mu", ""}})  // where there is no friction
        EXPECT_EQ(nearest_name(word, keys), name) << word;
    EXPECT_EQ(nearest_name("word", {}), "");
}

TEST(NearestName, EndsAMessageWhereThereIsOne) {
    EXPECT_EQ(nearest_hint("boxs", known, "; the nearest is {}"), "; the nearest is boxes");
    EXPECT_EQ(nearest_hint("foo", known, "; the nearest is {}"), "");
}

}  // namespace
}  // namespace nbd

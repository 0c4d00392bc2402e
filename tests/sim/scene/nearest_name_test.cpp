#include "sim/json/nearest_name.hpp"

#include <gtest/gtest.h>

namespace nbd {
namespace {

const std::vector<std::string> known{"exact",  "boxes", "bd", "nbd", "velocity", "stable_neo_hookean",
                                     "--nodes"};

TEST(NearestName, IsOfAWordWithOneWrongLetterInThree) {
    EXPECT_EQ(nearest_name("boxs", known), "boxes");
    EXPECT_EQ(nearest_name("bb", known), "bd");
    EXPECT_EQ(nearest_name("velosityy", known), "velocity");
    EXPECT_EQ(nearest_name("--nods", known), "--nodes");
    EXPECT_EQ(nearest_name("neo_hookean", known), "stable_neo_hookean");
}

TEST(NearestName, KnowsWhatOthersCallOurKeys) {
    const std::vector<std::string> keys{"law", "young", "poisson", "density", "rayleigh_mass", "--density"};
    for (const char* word : {"E", "youngs_modulus", "young_modulus"})
        EXPECT_EQ(nearest_name(word, keys), "young");
    EXPECT_EQ(nearest_name("nu", keys), "poisson");
    EXPECT_EQ(nearest_name("rho", keys), "density");
    EXPECT_EQ(nearest_name("--rho", keys), "--density");
    EXPECT_EQ(nearest_name("mu", keys), "") << "where there is no friction";
}

TEST(NearestName, IsEmptyForAnotherWord) {
    for (const char* word : {"", "--", "tight", "spheres", "--cage", "foo", "zz", "no"})
        EXPECT_EQ(nearest_name(word, known), "") << word;
    EXPECT_EQ(nearest_name("word", {}), "");
}

TEST(NearestName, EndsAMessageWhereThereIsOne) {
    EXPECT_EQ(nearest_hint("boxs", known, "; the nearest is {}"), "; the nearest is boxes");
    EXPECT_EQ(nearest_hint("foo", known, "; the nearest is {}"), "");
}

}  // namespace
}  // namespace nbd

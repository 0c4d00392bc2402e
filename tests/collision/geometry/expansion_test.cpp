#include "collision/geometry/expansion.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>

namespace nbd {
namespace {

// Oracle: 128-bit integers represent multiples of 2^-60 below 2^63.
__extension__ using Integer = __int128;
constexpr double quantum = 0x1p-60;

template <int N>
Integer value(const Expansion<N>& e) {
    Integer sum = 0;
    for (int i = 0; i < e.size(); ++i) sum += static_cast<Integer>(e[i] / quantum);
    return sum;
}

template <int N>
void expect_nonadjacent(const Expansion<N>& e) {
    for (int i = 0; i < e.size(); ++i) EXPECT_NE(e[i], 0);
    for (int i = 1; i < e.size(); ++i) {
        // The lowest set bit of a term is at least two above the highest of the previous term.
        int exponent = 0, below = 0;
        const double fraction = std::frexp(e[i], &exponent);
        std::frexp(e[i - 1], &below);
        const auto mantissa = static_cast<std::int64_t>(std::ldexp(fraction, 53));
        EXPECT_GT(exponent - 53 + __builtin_ctzll(static_cast<std::uint64_t>(mantissa)), below);
    }
}

class ExpansionArithmetic : public testing::Test {
 protected:
    /// A multiple of 2^-30 below 2^30 of random magnitude, often with few bits.
    double number() {
        const std::int64_t bits = random_();
        return std::ldexp(static_cast<double>((bits >> 11) >> (random_() % 53)), -30 + int(random_() % 8));
    }
    Expansion<2> difference() {
        const double a = number(), b = random_() % 4 ? number() : std::nextafter(a, 2 * a);
        return exact_difference(a, std::ldexp(std::round(std::ldexp(b, 30)), -30));
    }
    std::mt19937_64 random_{7};
};

TEST_F(ExpansionArithmetic, AgreesWithIntegersAndKeepsTermsNonadjacent) {
    int long_ones = 0;
    for (int round = 0; round < 20000; ++round) {
        const auto a = difference(), b = difference();
        ASSERT_EQ(value(a + b), value(a) + value(b));
        ASSERT_EQ(value(a - b), value(a) - value(b));
        expect_nonadjacent(a + b);
        expect_nonadjacent(a - b);
        long_ones += (a + b).size() > 1;

        // Small factors: multiples of 2^-30 below 2^31, so products fit.
        const auto c = exact_difference(std::fmod(number(), 0x1p30), std::fmod(number(), 0x1p30));
        const auto d = exact_difference(std::fmod(number(), 0x1p30), std::fmod(number(), 0x1p30));
        const auto product = c * d;
        ASSERT_EQ(value(product), (value(c) >> 30) * (value(d) >> 30));
        expect_nonadjacent(product);
        ASSERT_EQ(value(product - d * c), 0);
        EXPECT_EQ((product - d * c).size(), 0);
        const Integer v = value(product);
        EXPECT_EQ(product.sign(), (v > 0) - (v < 0));
        long_ones += product.size() > 1;
    }
    EXPECT_GT(long_ones, 5000);
}

TEST_F(ExpansionArithmetic, ReturnsRoundingErrorsExactly) {
    const auto [sum, sum_error] = two_sum(1, 0x1p-60);
    EXPECT_EQ(sum, 1);
    EXPECT_EQ(sum_error, 0x1p-60);
    const auto [product, product_error] = two_product(1 + 0x1p-40, 1 + 0x1p-40);
    EXPECT_EQ(product, 1 + 0x1p-39);
    EXPECT_EQ(product_error, 0x1p-80);
    EXPECT_EQ(exact_difference(1, 1).sign(), 0);
}

}  // namespace
}  // namespace nbd

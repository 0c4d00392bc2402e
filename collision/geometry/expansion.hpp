#pragma once

#include <array>
#include <cfloat>
#include <cmath>

#ifdef __FAST_MATH__
#error "Exact arithmetic needs IEEE rounding: compile without -ffast-math"
#endif
static_assert(FLT_EVAL_METHOD == 0, "exact arithmetic needs every operation on doubles to round to double");

namespace nbd {

/// A real number as the exact sum of doubles: nonzero, nonadjacent, in increasing order of magnitude, so the
/// last one has the sign of the sum. N: maximum number of terms; zeros are dropped.
/// Sums and products are exact as long as nothing over- or underflows and rounding is to nearest even.
/// Include this only in sources compiled with -ffp-contract=off: a multiply and an add fused by the compiler
/// break the error terms. Source: [Shewchuk97], theorems 10 (sum) and 19 (scaling).
template <int N>
class Expansion {
 public:
    /// Appends a term: zero, or larger in magnitude than the terms so far and nonadjacent to them.
    void append(double term) noexcept {
        if (term != 0) terms_[size_++] = term;
    }

    /// Adds any double; N must leave room for one more term.
    void add(double carry) noexcept;

    int size() const noexcept { return size_; }
    double operator[](int i) const noexcept { return terms_[i]; }
    int sign() const noexcept { return size_ == 0 ? 0 : terms_[size_ - 1] > 0 ? 1 : -1; }

 private:
    std::array<double, N> terms_;  // the first size_ are set
    int size_ = 0;
};

/// An exact result high + low: high is the rounded result, low its rounding error.
struct RoundedAndError {
    double high, low;
};

inline RoundedAndError two_sum(double a, double b) noexcept {
    const double sum = a + b;
    const double b_part = sum - a, a_part = sum - b_part;
    return {sum, (a - a_part) + (b - b_part)};
}

/// Like two_sum, for |a| >= |b| or a == 0.
inline RoundedAndError fast_two_sum(double a, double b) noexcept {
    const double sum = a + b;
    return {sum, b - (sum - a)};
}

inline RoundedAndError two_product(double a, double b) noexcept {
    const double product = a * b;
    return {product, std::fma(a, b, -product)};
}

/// a - b, exact.
inline Expansion<2> exact_difference(double a, double b) noexcept {
    const auto [high, low] = two_sum(a, -b);
    Expansion<2> e;
    e.append(low);
    e.append(high);
    return e;
}

template <int N>
void Expansion<N>::add(double carry) noexcept {
    const int before = size_;
    size_ = 0;
    for (int i = 0; i < before; ++i) {  // append() writes at or below i
        const auto [high, low] = two_sum(carry, terms_[i]);
        append(low);
        carry = high;
    }
    append(carry);
}

template <int N, int M>
Expansion<N + M> operator+(const Expansion<N>& e, const Expansion<M>& f) noexcept {
    Expansion<N + M> sum;
    for (int i = 0; i < e.size(); ++i) sum.append(e[i]);
    for (int i = 0; i < f.size(); ++i) sum.add(f[i]);
    return sum;
}

template <int N>
Expansion<N> operator-(const Expansion<N>& e) noexcept {
    Expansion<N> negative;
    for (int i = 0; i < e.size(); ++i) negative.append(-e[i]);
    return negative;
}

template <int N, int M>
Expansion<N + M> operator-(const Expansion<N>& e, const Expansion<M>& f) noexcept {
    return e + -f;
}

template <int N>
Expansion<2 * N> operator*(const Expansion<N>& e, double factor) noexcept {
    Expansion<2 * N> product;
    double carry = 0;
    for (int i = 0; i < e.size(); ++i) {
        const auto [high, low] = two_product(e[i], factor);
        const RoundedAndError middle = two_sum(carry, low);
        const RoundedAndError top = fast_two_sum(high, middle.high);
        product.append(middle.low);
        product.append(top.low);
        carry = top.high;
    }
    product.append(carry);
    return product;
}

template <int N>
Expansion<4 * N> operator*(const Expansion<N>& e, const Expansion<2>& f) noexcept {
    Expansion<2 * N> low, high;
    if (f.size() > 0) low = e * f[0];
    if (f.size() > 1) high = e * f[1];
    return low + high;
}

}  // namespace nbd

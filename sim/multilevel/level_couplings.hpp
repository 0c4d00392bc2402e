#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace nbd {

/// The couplings of a system at one level: J^T A J each, where J v is the sum of a 3 x B matrix times the
/// unknowns of a row, over a few rows.
template <int B>
struct LevelCouplings {
    struct Term {
        int row;
        Eigen::Matrix<float, 3, B> J;
    };
    std::vector<std::size_t> first{0};  // [couplings + 1] range of terms
    std::vector<Term> terms;

    std::size_t count() const noexcept { return first.size() - 1; }
    std::span<const Term> of(std::size_t coupling) const noexcept {
        return std::span(terms).subspan(first[coupling], first[coupling + 1] - first[coupling]);
    }

    /// Adds to the last coupling, until end().
    void add(int row, const Eigen::Matrix<float, 3, B>& J) {
        for (std::size_t t = first.back(); t < terms.size(); ++t)
            if (terms[t].row == row) {
                terms[t].J += J;
                return;
            }
        terms.push_back({row, J});
    }
    void end() { first.push_back(terms.size()); }

    void append(const LevelCouplings& others) {
        const std::size_t before = terms.size();
        terms.insert(terms.end(), others.terms.begin(), others.terms.end());
        for (std::size_t c = 1; c < others.first.size(); ++c) first.push_back(before + others.first[c]);
    }
};

/// A coupling that acts.
struct ActingCoupling {
    std::size_t index;
    Eigen::Matrix3f A;  // symmetric positive semi-definite
};

}  // namespace nbd

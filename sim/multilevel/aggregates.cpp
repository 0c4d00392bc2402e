#include "sim/multilevel/aggregates.hpp"

#include <algorithm>
#include <cmath>

namespace nbd {
namespace {

constexpr int alone = -1, free_row = -2;

}  // namespace

Aggregates aggregate(const std::vector<std::vector<int>>& strong) {
    const std::size_t rows = strong.size();
    Aggregates result{.of = std::vector<int>(rows, free_row)};
    std::vector<int>& of = result.of;
    for (std::size_t i = 0; i < rows; ++i)
        if (strong[i].size() <= 1) of[i] = alone;
    const auto is_free = [&](int j) { return of[j] == free_row; };
    const auto take = [&](std::size_t i) {
        for (const int j : strong[i])
            if (is_free(j)) of[j] = result.count;
        ++result.count;
    };
    for (std::size_t i = 0; i < rows; ++i)
        if (of[i] == free_row && std::ranges::all_of(strong[i], is_free)) take(i);
    // Rows in between join; they must not attract others before all have joined.
    const std::vector<int> cores = of;
    std::vector<int> votes(result.count, 0);
    for (std::size_t i = 0; i < rows; ++i) {
        if (of[i] != free_row) continue;
        int most = 0;
        for (const int j : strong[i])
            if (const int a = cores[j]; a >= 0)
                if (const int count = ++votes[a]; count > most) {
                    most = count;
                    of[i] = a;
                }
        for (const int j : strong[i])
            if (const int a = cores[j]; a >= 0) votes[a] = 0;
    }
    for (std::size_t i = 0; i < rows; ++i)
        if (of[i] == free_row) take(i);
    return result;
}

RigidModes<3> rigid_modes(const Nodes& X) {
    const Eigen::RowVector3d centre = X.colwise().mean();
    const double size = std::sqrt((X.rowwise() - centre).rowwise().squaredNorm().mean());
    RigidModes<3> modes(X.rows());
    for (Eigen::Index i = 0; i < X.rows(); ++i) {
        const Eigen::RowVector3d r = (X.row(i) - centre) / size;
        modes[i] << 1, 0, 0, 0, r[2], -r[1],  //
            0, 1, 0, -r[2], 0, r[0],          //
            0, 0, 1, r[1], -r[0], 0;
    }
    return modes;
}

template <int B>
Tentative<B> tentative(const Aggregates& aggregates, const RigidModes<B>& modes) {
    constexpr double nothing = 1e-6;  // share of a motion below which it is rounding
    const std::size_t count = aggregates.count;
    std::vector<std::vector<std::size_t>> members(count);
    for (std::size_t i = 0; i < aggregates.of.size(); ++i)
        if (const int a = aggregates.of[i]; a >= 0) members[a].push_back(i);
    RigidModes<B> Q = modes;
    Tentative<B> result;
    result.modes.assign(count, Eigen::Matrix<double, 6, 6>::Zero());
    for (std::size_t a = 0; a < count; ++a) {
        const auto dot = [&](int c, int d) {
            double sum = 0;
            for (const std::size_t i : members[a]) sum += Q[i].col(c).dot(Q[i].col(d));
            return sum;
        };
        Eigen::Matrix<double, 6, 6>& R = result.modes[a];
        for (int c = 0; c < 6; ++c) {
            const double before = std::sqrt(dot(c, c));
            for (int pass = 0; pass < 2; ++pass)  // the second removes what rounding left
                for (int d = 0; d < c; ++d) {
                    const double share = dot(d, c);
                    R(d, c) += share;
                    for (const std::size_t i : members[a]) Q[i].col(c) -= share * Q[i].col(d);
                }
            const double left = std::sqrt(dot(c, c));
            const bool vanishes = !(left > nothing * before);
            R(c, c) = vanishes ? 0 : left;
            for (const std::size_t i : members[a]) Q[i].col(c) *= vanishes ? 0 : 1 / left;
        }
    }
    result.P.columns = aggregates.count;
    for (std::size_t i = 0; i < aggregates.of.size(); ++i) {
        if (const int a = aggregates.of[i]; a >= 0) {
            result.P.column.push_back(a);
            result.P.blocks.push_back(Q[i]);
        }
        result.P.end_row();
    }
    return result;
}

template Tentative<3> tentative<3>(const Aggregates&, const RigidModes<3>&);
template Tentative<6> tentative<6>(const Aggregates&, const RigidModes<6>&);

}  // namespace nbd

#include "sim/multilevel/rest_hierarchy.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "sim/multilevel/aggregates.hpp"

namespace nbd {
namespace {

constexpr double strong_share = 0.08;  // see strong_neighbours(), on the finest level
constexpr double worthwhile = 0.7;  // a level with a larger share of the rows of the one before is left out
constexpr int aggregates_per_part = 64;         // of sweeps
constexpr std::size_t max_entries_of_body = 8;  // a body's oldest entry is dropped beyond this number

template <int B>
using Square = Eigen::Matrix<double, B, B>;

BlockSparse<3, 3> rest_matrix(const ElasticBody& body, double mass_scale, double stiffness_scale,
                              const std::vector<char>& prescribed) {
    ElementPose pose;
    ElementForces forces;
    body.pose(body.rest().X, pose, forces);
    StepMatrix A = body.zero_matrix();
    body.combine(mass_scale, stiffness_scale, pose, A);
    for (int i = 0; i < body.node_count(); ++i)
        if (prescribed[i]) A.isolate(i);
    BlockSparse<3, 3> blocks{body.pattern().lists(), body.node_count(), {}};
    for (int i = 0; i < body.node_count(); ++i)
        for (int k = 0; k < std::ssize(blocks.columns_of(i)); ++k) blocks.blocks.push_back(A.block(i, k));
    return blocks;
}

/// Diagonal blocks. Zeros on their diagonals, of motions that an aggregate does not have, become ones, in A
/// too.
template <int B>
std::vector<Square<B>> take_diagonal(BlockSparse<B, B>& A) {
    std::vector<Square<B>> diagonal;
    for (int i = 0; i < A.rows(); ++i) {
        const auto row = A.columns_of(i);
        const auto own = std::ranges::lower_bound(row, i) - row.begin();
        Square<B>& block = A.blocks[A.offset[i] + own];
        for (int c = 0; c < B; ++c)
            if (block(c, c) == 0) block(c, c) = 1;
        diagonal.push_back(block);
    }
    return diagonal;
}

template <int B>
std::vector<Square<B>> inverses(const std::vector<Square<B>>& blocks) {
    std::vector<Square<B>> result(blocks.size());
    for (std::size_t i = 0; i < blocks.size(); ++i) result[i] = blocks[i].inverse();
    return result;
}

/// A bound on the eigenvalues of D^-1 A: the largest one by power iteration, and a tenth more for what the
/// iteration has not found.
template <int B>
double largest_eigenvalue(const BlockSparse<B, B>& A, const std::vector<Square<B>>& inverse) {
    constexpr int rounds = 60;
    constexpr double margin = 1.1;
    using Vectors = std::vector<Eigen::Matrix<double, B, 1>>;
    Vectors v(inverse.size()), Av(inverse.size());
    double seed = 0.5;  // an irregular start has a share of every eigenvector
    for (auto& part : v)
        for (int c = 0; c < B; ++c) {
            seed = 3.9 * seed * (1 - seed);
            part[c] = seed - 0.5;
        }
    double value = 1;
    for (int round = 0; round < rounds; ++round) {
        double before = 0, after = 0;
        parallel_for(A.rows(), [&](int i) {
            Eigen::Matrix<double, B, 1> sum = Eigen::Matrix<double, B, 1>::Zero();
            const auto row = A.columns_of(i);
            for (std::size_t k = 0; k < row.size(); ++k) sum += A.block(i, k) * v[row[k]];
            Av[i] = inverse[i] * sum;
        });
        for (std::size_t i = 0; i < v.size(); ++i) {
            before += v[i].squaredNorm();
            after += Av[i].squaredNorm();
        }
        if (!(after > 0)) break;
        value = std::sqrt(after / before);
        for (std::size_t i = 0; i < v.size(); ++i) v[i] = Av[i] / std::sqrt(after);
    }
    return margin * value;
}

/// (I - 4/3 / bound D^-1 A) P: the columns of P with less energy [Vanek96].
template <int B>
BlockSparse<B, 6> smoothed(const BlockSparse<B, B>& A, const std::vector<Square<B>>& inverse, double bound,
                           const BlockSparse<B, 6>& P) {
    BlockSparse<B, 6> result = product(A, P);
    for (int i = 0; i < result.rows(); ++i) {
        const auto row = result.columns_of(i), own = P.columns_of(i);
        for (std::size_t k = 0; k < row.size(); ++k) {
            auto& block = result.blocks[result.offset[i] + k];
            block = (-4.0 / 3 / bound) * (inverse[i] * block).eval();
            if (!own.empty() && own[0] == row[k]) block += P.block(i, 0);
        }
    }
    return result;
}

LevelMatrix<6> sweep_matrix(const BlockSparse<6, 6>& A) {
    LevelMatrix<6> result(std::make_shared<const SweepOrder>(A, aggregates_per_part));
    for (int i = 0; i < A.rows(); ++i)
        for (std::size_t k = 0; k < A.columns_of(i).size(); ++k)
            if (A.columns_of(i)[k] != i) result.set(i, k, A.block(i, k));
    return result;
}

/// Both halves alike to the last bit, so that they are rounded alike.
BlockSparse<6, 6> symmetric(BlockSparse<6, 6> A) {
    const auto place = [&](int i, int j) {
        const auto row = A.columns_of(i);
        return A.offset[i] + (std::ranges::lower_bound(row, j) - row.begin());
    };
    for (int i = 0; i < A.rows(); ++i)
        for (const int j : A.columns_of(i)) {
            if (j > i) break;
            const Square<6> mean = 0.5 * (A.blocks[place(i, j)] + A.blocks[place(j, i)].transpose());
            A.blocks[place(i, j)] = mean;
            A.blocks[place(j, i)] = mean.transpose();
        }
    return A;
}

/// A level's interpolation from the next, and the next level's matrix and rigid motions.
template <int B>
struct Coarser {
    Transfer<B> transfer;
    BlockSparse<6, 6> A;
    RigidModes<6> modes;
};

template <int B>
Coarser<B> coarsen(const BlockSparse<B, B>& A, const std::vector<Square<B>>& inverse, double bound,
                   const RigidModes<B>& modes, double strong) {
    const Tentative<B> rigid = tentative(aggregate(strong_neighbours(A, strong)), modes);
    const BlockSparse<B, 6> P = smoothed(A, inverse, bound, rigid.P);
    const BlockSparse<6, B> PT = transpose(P);
    return {.transfer = {TransferMatrix<B, 6>(P), TransferMatrix<6, B>(PT)},
            .A = symmetric(product(PT, product(A, P))),
            .modes = rigid.modes};
}

}  // namespace

RestHierarchy::RestHierarchy(const ElasticBody& body, double mass_scale, double stiffness_scale,
                             const std::vector<char>& prescribed) {
    BlockSparse<3, 3> A = rest_matrix(body, mass_scale, stiffness_scale, prescribed);
    const auto inverse = inverses(take_diagonal(A));
    const double most = largest_eigenvalue(A, inverse);
    double share = strong_share;
    Coarser<3> first = coarsen<3>(A, inverse, most, rigid_modes(body.rest().X), share);
    A = {};
    fine = std::move(first.transfer);
    BlockSparse<6, 6> current = std::move(first.A);
    RigidModes<6> modes = std::move(first.modes);
    for (bool going = true; going;) {
        share /= 2;  // coarser matrices are denser [Vanek96]
        RestLevel level;
        level.diagonal = take_diagonal(current);
        level.A = sweep_matrix(current);
        const auto level_inverse = inverses(level.diagonal);
        const double level_most = largest_eigenvalue(current, level_inverse);
        Coarser<6> next = coarsen<6>(current, level_inverse, level_most, modes, share);
        going = next.A.rows() > 0 && next.A.rows() < worthwhile * current.rows();
        if (current.rows() <= coarse_enough || !going) level.to_factorize = std::move(current);
        if (going) {
            level.coarser = std::move(next.transfer);
            current = std::move(next.A);
            modes = std::move(next.modes);
        }
        levels.push_back(std::move(level));
    }
}

std::size_t RestHierarchy::depth(int aggregates) const {
    const auto few = [&](const RestLevel& level) { return level.A.rows() <= aggregates; };
    const auto found = std::ranges::find_if(levels, few);
    return std::min<std::size_t>(found - levels.begin() + 1, levels.size());
}

std::shared_ptr<const RestHierarchy> RestHierarchies::get(const ElasticBody& body, double mass_scale,
                                                          double stiffness_scale,
                                                          const std::vector<char>& prescribed) {
    const std::lock_guard lock(mutex_);
    if (!entries_.contains(body.identity()))
        std::erase_if(entries_, [](const auto& of_body) { return of_body.first.expired(); });
    std::vector<Entry>& entries = entries_[body.identity()];
    const auto known = std::ranges::find_if(entries, [&](const Entry& e) {
        return e.mass_scale == mass_scale && e.stiffness_scale == stiffness_scale &&
               e.prescribed == prescribed;
    });
    if (known != entries.end()) return known->hierarchy;
    if (entries.size() == max_entries_of_body) entries.erase(entries.begin());
    entries.push_back({mass_scale, stiffness_scale, prescribed,
                       std::make_shared<const RestHierarchy>(body, mass_scale, stiffness_scale, prescribed)});
    return entries.back().hierarchy;
}

}  // namespace nbd

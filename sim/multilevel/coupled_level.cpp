#include "sim/multilevel/coupled_level.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

template <int B>
using Column = Eigen::Matrix<float, B, 1>;
template <int B>
using At = Eigen::Map<Column<B>>;
template <int B>
using ConstAt = Eigen::Map<const Column<B>>;

template <int B>
Column<B> column(const LaneVector<B>& lanes) {
    Column<B> result;
    for (int c = 0; c < B; ++c) result[c] = lanes[c];
    return result;
}

}  // namespace

template <int B>
void CoupledLevel<B>::begin(std::vector<const LevelMatrix<B>*> matrices, std::vector<Diagonal> diagonals) {
    matrices_ = std::move(matrices);
    diagonals_ = std::move(diagonals);
    coupled_.clear();
    first_.assign(1, 0);
    colours_.clear();
    for (std::size_t body = 0; body < matrices_.size(); ++body) {
        const auto& colours = matrices_[body]->order().colours;
        if (colours_.size() < colours.size()) colours_.resize(colours.size());
        for (std::size_t c = 0; c < colours.size(); ++c)
            for (const RowRange& rows : colours[c]) colours_[c].push_back({body, rows});
        first_.push_back(first_.back() + matrices_[body]->rows());
    }
    divide_rows();
    inverses_.resize(rows());
    for_rows([&](std::size_t body, RowRange rows) {
        for (int i = rows.begin; i < rows.end; ++i)
            inverses_[first_[body] + i] = diagonals_[body][i].inverse().template cast<float>();
    });
    for (std::vector<float>* vector : {&b, &z, &residual, &correction}) vector->resize(B * rows());
}

/// Tasks of about as many rows: parts of large bodies, several small ones.
template <int B>
void CoupledLevel<B>::divide_rows() {
    constexpr int rows_per_task = B == 3 ? 256 : 64;
    ranges_.clear();
    task_begin_.assign(1, 0);
    int in_task = 0;
    for (std::size_t body = 0; body < matrices_.size(); ++body) {
        const int count = matrices_[body]->rows();
        for (int begin = 0, end = 0; begin < count; begin = end) {
            end = std::min(count, begin + rows_per_task - in_task);
            ranges_.push_back({body, {begin, end}});
            in_task += end - begin;
            if (in_task < rows_per_task) continue;
            task_begin_.push_back(ranges_.size());
            in_task = 0;
        }
    }
    if (in_task > 0) task_begin_.push_back(ranges_.size());
}

template <int B>
std::size_t CoupledLevel<B>::body_of(int row) const noexcept {
    return std::ranges::upper_bound(first_, row) - first_.begin() - 1;
}

template <int B>
void CoupledLevel<B>::set_couplings(const CouplingMatrix<B>& couplings) {
    for (std::size_t k = 0; k < coupled_.size(); ++k) inverses_[coupled_[k]] = uncoupled_[k];
    coupled_ = couplings.rows;
    uncoupled_.resize(coupled_.size());
    damping_.resize(coupled_.size());
    coupling_lists_ = couplings.blocks;
    for (int& column : coupling_lists_.column) column = coupled_[column];
    coupling_blocks_ = FloatBlocks<B, B>(couplings.blocks.blocks.size());
    for (std::size_t k = 0; k < couplings.blocks.blocks.size(); ++k)
        coupling_blocks_.set(k, couplings.blocks.blocks[k]);
    parallel_for(
        coupled_.size(),
        [&](int k) {
            const std::size_t at = k, row = coupled_[at];
            const std::size_t body = body_of(coupled_[at]);
            const Eigen::Matrix<double, B, B> block =
                diagonals_[body][row - first_[body]] + couplings.damping[at];
            uncoupled_[at] = inverses_[row];
            damping_[at] = couplings.damping[at].template cast<float>();
            inverses_[row] = block.inverse().template cast<float>();
        },
        64);
}

template <int B>
void CoupledLevel<B>::subtract_couplings(const float* from, float* to) const {
    parallel_for(
        coupled_.size(),
        [&](int k) {
            At<B>(to + B * coupled_[k]) -= column<B>(
                coupling_blocks_.row_product(coupling_lists_.offset[k], coupling_lists_.columns_of(k), from));
        },
        64);
}

/// Calls visit(body, rows) for the parts of a colour, in parallel.
template <int B>
template <class Visit>
void CoupledLevel<B>::sweep_colour(std::size_t colour, const Visit& visit) const {
    const std::vector<Part>& parts = colours_[colour];
    parallel_for(
        parts.size(),
        [&](int p) {
            const Part& part = parts[p];
            visit(part.body, part.rows);
        },
        1);
}

/// to += (D' - T - C) from, with the damping D' of the couplings C, and times(matrix, i, v) for row i of T v.
template <int B>
template <class Times>
void CoupledLevel<B>::add_remainder(const float* from, float* to, const Times& times) const {
    for_rows([&](std::size_t body, RowRange rows) {
        const int first = B * first_[body];
        for (int i = rows.begin; i < rows.end; ++i)
            At<B>(to + first + B * i) -= column<B>(times(*matrices_[body], i, from + first));
    });
    add_damping(from, to);
    subtract_couplings(from, to);
}

/// to += D' from.
template <int B>
void CoupledLevel<B>::add_damping(const float* from, float* to) const {
    for (std::size_t k = 0; k < coupled_.size(); ++k)
        At<B>(to + B * coupled_[k]) += damping_[k] * ConstAt<B>(from + B * coupled_[k]);
}

/// With the matrices' part L before the diagonal D and U after it: z = (L + D + D')^-1 b, and
/// b - (L + D + U + C) z = (D' - U - C) z.
template <int B>
void CoupledLevel<B>::smooth_from_zero() {
    for (std::size_t c = 0; c < colours_.size(); ++c)
        sweep_colour(c, [&](std::size_t body, RowRange rows) {
            float* own = z.data() + B * first_[body];
            for (int i = rows.begin; i < rows.end; ++i) {
                const int row = first_[body] + i;
                At<B>(own + B * i) = inverses_[row] * (ConstAt<B>(b.data() + B * row) -
                                                       column<B>(matrices_[body]->times_earlier(i, own)));
            }
        });
    std::ranges::fill(residual, 0.F);
    add_remainder(z.data(), residual.data(),
                  [](const auto& A, int i, const float* v) { return A.times_later(i, v); });
}

/// (D + D' + U) z = b + (D' - L - C) old, where old is z before the sweep. Rows of L old do not wait for one
/// another, which makes this faster than sweeping over L and U at once.
template <int B>
void CoupledLevel<B>::correct_and_smooth() {
    parallel_for(rows(), [&](int i) { At<B>(z.data() + B * i) += ConstAt<B>(correction.data() + B * i); });
    add_remainder(z.data(), b.data(),
                  [](const auto& A, int i, const float* v) { return A.times_earlier(i, v); });
    for (std::size_t c = colours_.size(); c-- > 0;)
        sweep_colour(c, [&](std::size_t body, RowRange rows) {
            const int first = first_[body];
            float* own = z.data() + B * first;
            for (int i = rows.end; i-- > rows.begin;) {
                const Column<B> old = ConstAt<B>(own + B * i);
                At<B>(own + B * i) = inverses_[first + i] * (ConstAt<B>(b.data() + B * (first + i)) -
                                                             column<B>(matrices_[body]->times_later(i, own)));
                At<B>(correction.data() + B * (first + i)) = ConstAt<B>(own + B * i) - old;
            }
        });
}

/// With the change by the last sweep, b - (L + D + U + C) z = (D' - L - C) change.
template <int B>
void CoupledLevel<B>::take_residual() {
    std::ranges::fill(residual, 0.F);
    add_remainder(correction.data(), residual.data(),
                  [](const auto& A, int i, const float* v) { return A.times_earlier(i, v); });
}

template class CoupledLevel<3>;
template class CoupledLevel<6>;

}  // namespace nbd

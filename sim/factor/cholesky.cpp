#include "sim/factor/cholesky.hpp"

#include <cholmod.h>
#include <fmt/format.h>

#include <mutex>
#include <stdexcept>
#include <vector>

#include "sim/factor/blas.hpp"

namespace nbd {
namespace {

// CHOLMOD view of a symmetric matrix; CHOLMOD reads only the lower triangle.
cholmod_sparse lower_view(int n, const int* column, const int* row, const double* value) {
    cholmod_sparse view{};
    view.nrow = view.ncol = n;
    view.nzmax = column[n];
    view.p = const_cast<int*>(column);
    view.i = const_cast<int*>(row);
    view.x = const_cast<double*>(value);
    view.stype = -1;
    view.itype = CHOLMOD_INT;
    view.xtype = value ? CHOLMOD_REAL : CHOLMOD_PATTERN;
    view.dtype = CHOLMOD_DOUBLE;
    view.sorted = view.packed = 1;
    return view;
}

cholmod_sparse lower_view(const SparseMatrix& A) {
    return lower_view(A.cols(), A.outerIndexPtr(), A.innerIndexPtr(), A.valuePtr());
}

/// METIS uses the C library's global random generator. One ordering at a time gives the same bits.
std::mutex metis;

}  // namespace

struct Cholesky::State {
    cholmod_common common{};
    cholmod_factor* factor = nullptr;
    cholmod_dense *x = nullptr, *y = nullptr, *e = nullptr;  // workspace of solve()
    int size = 0;
    Eigen::Index entries = 0;
    bool factorized = false;

    State() {
        hold_blas_to_one_thread();
        cholmod_start(&common);
        common.supernodal = CHOLMOD_SUPERNODAL;
        common.quick_return_if_not_posdef = 1;
        common.print = 0;
    }
    ~State() {
        cholmod_free_dense(&x, &common);
        cholmod_free_dense(&y, &common);
        cholmod_free_dense(&e, &common);
        cholmod_free_factor(&factor, &common);
        cholmod_finish(&common);
    }
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    void require(bool ok, const char* what) const {
        if (ok && common.status >= CHOLMOD_OK) return;
        const char* why = common.status == CHOLMOD_OUT_OF_MEMORY ? "out of memory"
                          : common.status == CHOLMOD_TOO_LARGE   ? "matrix too large"
                                                                 : "internal error";
        throw std::runtime_error(
            fmt::format("CHOLMOD {}: {} (status {}), {} unknowns", what, why, common.status, size));
    }

    // The nodes of a graph in the order of elimination.
    std::vector<int> order(const RowLists& lower, Ordering ordering) {
        cholmod_sparse graph = lower_view(lower.rows(), lower.offset.data(), lower.column.data(), nullptr);
        common.nmethods = ordering == Ordering::quick ? 1 : 2;
        common.method[0].ordering = CHOLMOD_AMD;
        // Uses CHOLMOD's nested dissection with METIS separators. METIS's own nested dissection would catch
        // SIGTERM and SIGABRT and jump out of whichever thread receives them.
        common.method[1].ordering = CHOLMOD_NESDIS;
        std::unique_lock lock(metis, std::defer_lock);
        if (ordering == Ordering::thorough) lock.lock();
        cholmod_factor* symbolic = cholmod_analyze(&graph, &common);
        require(symbolic != nullptr, "ordering");
        const int* first = static_cast<const int*>(symbolic->Perm);
        std::vector<int> nodes(first, first + lower.rows());
        cholmod_free_factor(&symbolic, &common);
        return nodes;
    }

    // Orders nodes instead of unknowns: the graph has a third of the size, and the three unknowns of a node
    // stay together.
    std::vector<int> permutation(const SparseMatrix& A, Ordering ordering) {
        RowLists lower;
        for (int j = 0; j < size / 3; ++j) {
            for (int s = A.outerIndexPtr()[3 * j]; s < A.outerIndexPtr()[3 * j + 1]; s += 3)
                lower.column.push_back(A.innerIndexPtr()[s] / 3);
            lower.end_row();
        }
        const std::vector<int> nodes = order(lower, ordering);
        std::vector<int> unknowns(size);
        for (int i = 0; i < size; ++i) unknowns[i] = 3 * nodes[i / 3] + i % 3;
        return unknowns;
    }
};

std::vector<int> elimination_order(const BlockPattern& lower, Ordering ordering) {
    Cholesky::State state;
    state.size = 3 * lower.node_count();
    return state.order(lower.lists(), ordering);
}

Cholesky::Cholesky() : state_(std::make_unique<State>()) {}
Cholesky::~Cholesky() = default;
Cholesky::Cholesky(Cholesky&&) noexcept = default;
Cholesky& Cholesky::operator=(Cholesky&&) noexcept = default;

void Cholesky::analyze(const SparseMatrix& A, Ordering ordering) {
    State& s = *state_;
    s.factorized = false;
    s.size = A.cols();
    s.entries = A.nonZeros();
    cholmod_free_factor(&s.factor, &s.common);
    std::vector<int> permutation;
    if (ordering != Ordering::given) permutation = s.permutation(A, ordering);

    s.common.nmethods = 1;
    s.common.method[0].ordering = ordering == Ordering::given ? CHOLMOD_NATURAL : CHOLMOD_GIVEN;
    s.common.postorder = ordering != Ordering::given;
    cholmod_sparse view = lower_view(A);
    s.factor =
        cholmod_analyze_p(&view, permutation.empty() ? nullptr : permutation.data(), nullptr, 0, &s.common);
    s.common.postorder = true;
    s.require(s.factor != nullptr, "analysis");
}

void Cholesky::factorize(const SparseMatrix& A) {
    if (try_factorize(A)) return;
    const cholmod_factor& factor = *state_->factor;
    const int unknown = static_cast<const int*>(factor.Perm)[factor.minor];
    throw std::runtime_error(
        fmt::format("factorize: the matrix is not positive definite (pivot of node {})", unknown / 3));
}

bool Cholesky::try_factorize(const SparseMatrix& A) {
    State& s = *state_;
    s.factorized = false;
    if (!s.factor || A.cols() != s.size || A.nonZeros() != s.entries)
        throw std::invalid_argument(
            fmt::format("factorize: matrix has {} columns and {} entries, but the analysed one has {} and {}",
                        A.cols(), A.nonZeros(), s.size, s.entries));
    if (!A.coeffs().allFinite()) throw std::runtime_error("factorize: the matrix holds a NaN or an infinity");
    cholmod_sparse view = lower_view(A);
    const SerialOpenMP serial;
    const int ok = cholmod_factorize(&view, s.factor, &s.common);
    s.require(ok, "factorisation");
    s.factorized = s.factor->minor == s.factor->n;
    return s.factorized;
}

bool Cholesky::factorized() const noexcept { return state_->factorized; }

void Cholesky::solve(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> x) const {
    State& s = *state_;
    if (!s.factorized) throw std::logic_error("solve: no factor; call factorize() first");
    if (b.size() != s.size || x.size() != s.size)
        throw std::invalid_argument(
            fmt::format("solve: vectors of {} and {} entries; allowed: {}", b.size(), x.size(), s.size));
    cholmod_dense view{};
    view.nrow = view.nzmax = view.d = s.size;
    view.ncol = 1;
    view.x = const_cast<double*>(b.data());
    view.xtype = CHOLMOD_REAL;
    view.dtype = CHOLMOD_DOUBLE;
    const SerialOpenMP serial;
    const int ok = cholmod_solve2(CHOLMOD_A, s.factor, &view, nullptr, &s.x, nullptr, &s.y, &s.e, &s.common);
    s.require(ok, "solve");
    x = Eigen::Map<const Eigen::VectorXd>(static_cast<const double*>(s.x->x), s.size);
}

}  // namespace nbd

#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/bench/measure/rows.hpp"
#include "apps/cli/output.hpp"
#include "meshing/body/body.hpp"

namespace nbd {

struct ElementStudyConfig {
    int levels = 3;        // how often tetrahedra are split into eight for the reference, at most
    int repeats = 5;       // times are medians over these
    double poisson = 0.4;  // Poisson's ratio; errors do not depend on the other constants
};

/// Tetrahedra of one kind on one mesh: their error and what a solve costs, on one thread.
struct ElementRow {
    std::string body;
    int nodes_per_tet = 4;
    int level = 0;  // how often the body's tetrahedra were split
    bool reference = false;
    int tets = 0, nodes = 0, unknowns = 0;
    std::int64_t nonzeros = 0;  // of the matrix, both triangles
    // Errors, relative: of the displacements at the body's own nodes, root of mean squares, and in the energy
    // norm. Those of the reference are extrapolated; NaN if that is impossible.
    double displacement = 0, energy = 0;
    double assembly = 0, factorisation = 0, solve = 0;  // ms of the processor; see study_elements()

    double total() const { return assembly + factorisation + solve; }
};

/// Compares linear tetrahedra (4 nodes) with quadratic ones of straight edges (10 nodes). The body, of one
/// material, is held at the corners in the first tenth of its longest axis, and bent by gravity along the
/// shortest; displacements are small. Its mesh is split into eight again and again, so that the geometry is
/// the same in all rows. The body has linear tetrahedra. Rows: linear tetrahedra that were split 0 to
/// `levels` + 1 times, quadratic ones 0 to `levels` - 1 times, and last the reference, by which errors are
/// measured: quadratic ones that were split `levels` times. It has the nodes of the finest linear ones.
/// Squares of errors in energy are too small by the square of the reference's. The order of elimination is
/// made before times are taken; the finest two rows are timed once. Throws std::runtime_error, naming the
/// body, if it is too large or in several parts.
std::vector<ElementRow> study_elements(const Body& body, const ElementStudyConfig& config, Output& out);

/// Whether a row is one of quadratic tetrahedra that linear ones are compared with.
bool is_compared(const ElementRow& row) noexcept;

/// What linear tetrahedra of the same error cost, in multiples of what quadratic ones do.
struct CostRatios {
    double unknowns = 0, nonzeros = 0, milliseconds = 0;
    bool at_least = false;  // the finest linear tetrahedra have a larger error: the ratios are theirs
};

/// Interpolates costs of the linear tetrahedra of the body of the same name between the errors next to that
/// of `quadratic`, in logarithms. error: &ElementRow::displacement or &ElementRow::energy. Empty if all
/// linear ones have a smaller error.
std::optional<CostRatios> equal_error(std::span<const ElementRow> rows, const ElementRow& quadratic,
                                      double ElementRow::*error);

/// One row each, with the ratios of quadratic ones; null where there is none.
Rows to_rows(std::span<const ElementRow> rows);

}  // namespace nbd

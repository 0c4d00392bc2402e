#pragma once

#include <filesystem>
#include <optional>
#include <span>

#include "apps/bench/elements/element_study.hpp"

namespace nbd {

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

/// Writes CSV, one line per row, with the ratios of quadratic ones. Atomic.
void write_table(const std::filesystem::path& path, std::span<const ElementRow> rows);

}  // namespace nbd

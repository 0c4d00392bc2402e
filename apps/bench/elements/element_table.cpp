#include "apps/bench/elements/element_table.hpp"

#include <fmt/core.h>

#include <cmath>
#include <string>
#include <vector>

#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

CostRatios ratios(const ElementRow& linear, const ElementRow& quadratic) {
    return {.unknowns = static_cast<double>(linear.unknowns) / quadratic.unknowns,
            .nonzeros = static_cast<double>(linear.nonzeros) / static_cast<double>(quadratic.nonzeros),
            .milliseconds = linear.total() / quadratic.total()};
}

std::string cells(const std::optional<CostRatios>& r) {
    if (!r) return ",,,";
    return fmt::format("{:.3g},{:.3g},{:.3g},{}", r->unknowns, r->nonzeros, r->milliseconds,
                       static_cast<int>(r->at_least));
}

}  // namespace

bool is_compared(const ElementRow& row) noexcept { return row.nodes_per_tet == 10 && !row.reference; }

std::optional<CostRatios> equal_error(std::span<const ElementRow> rows, const ElementRow& quadratic,
                                      double ElementRow::*error) {
    const double wanted = quadratic.*error;
    const ElementRow* coarser = nullptr;
    for (const ElementRow& row : rows) {
        if (row.body != quadratic.body || row.nodes_per_tet != 4) continue;
        if (row.*error <= wanted) {
            if (!coarser) return {};
            const double share = std::log(wanted / coarser->*error) / std::log(row.*error / coarser->*error);
            const auto between = [&](double from, double to) { return from * std::pow(to / from, share); };
            const CostRatios from = ratios(*coarser, quadratic), to = ratios(row, quadratic);
            return CostRatios{.unknowns = between(from.unknowns, to.unknowns),
                              .nonzeros = between(from.nonzeros, to.nonzeros),
                              .milliseconds = between(from.milliseconds, to.milliseconds)};
        }
        coarser = &row;
    }
    if (!coarser) return {};
    CostRatios least = ratios(*coarser, quadratic);
    least.at_least = true;
    return least;
}

void write_table(const std::filesystem::path& path, std::span<const ElementRow> rows) {
    h5::AtomicFile file(path);
    file.out() << "body,nodes_per_tet,level,reference,tets,nodes,unknowns,nonzeros,displacement_error,"
                  "energy_error,assembly_ms,factorisation_ms,solve_ms";
    for (const char* error : {"displacement", "energy"})
        file.out() << fmt::format(",{0}_unknowns_ratio,{0}_nonzeros_ratio,{0}_ms_ratio,{0}_at_least", error);
    file.out() << '\n';
    for (const ElementRow& r : rows) {
        file.out() << fmt::format("{},{},{},{},{},{},{},{},{:.3g},{:.3g},{:.3f},{:.3f},{:.3f}", r.body,
                                  r.nodes_per_tet, r.level, static_cast<int>(r.reference), r.tets, r.nodes,
                                  r.unknowns, r.nonzeros, r.displacement, r.energy, r.assembly,
                                  r.factorisation, r.solve);
        for (double ElementRow::*error : {&ElementRow::displacement, &ElementRow::energy})
            file.out() << ',' << cells(is_compared(r) ? equal_error(rows, r, error) : std::nullopt);
        file.out() << '\n';
    }
    file.commit();
}

}  // namespace nbd

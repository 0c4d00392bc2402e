#include "collision/bounds/certified/certified_model.hpp"

#include <cmath>
#include <utility>

#include "collision/base/requirement.hpp"
#include "collision/bounds/certified/region_meter.hpp"

namespace nbd {
namespace {

bool length(float x) noexcept { return x >= 0 && std::isfinite(x); }

void check_cell(const CertifiedModel& model, std::size_t i, int vertex_count) {
    constexpr Requirement require("certified tree");
    const CertifiedModel::Cell& cell = model.cells[i];
    require(cell.anchor >= 0 && cell.anchor < vertex_count, "cell ", i, " has its anchor at vertex ",
            cell.anchor, ", but the surface has ", vertex_count);
    require(cell.carrier >= 0 && cell.carrier < model.regions.count(), "cell ", i, " refers to region ",
            cell.carrier, " of ", model.regions.count());
    require(cell.leg_begin >= 0 && cell.leg_begin <= cell.leg_end &&
                std::cmp_less_equal(cell.leg_end, model.legs.size()),
            "cell ", i, " lists legs ", cell.leg_begin, " to ", cell.leg_end, " of ", model.legs.size());
    require(length(cell.path) && cell.weight > 0 && std::isfinite(cell.weight) && cell.m.allFinite() &&
                cell.B.allFinite(),
            "cell ", i, " has a number that is not finite or out of range");
    require(cell.path == 0 || cell.leg_begin < cell.leg_end, "cell ", i, " has paths through no region");
    for (int k = cell.leg_begin; k < cell.leg_end; ++k) {
        const auto [pair, leg] = model.legs[static_cast<std::size_t>(k)];
        require(length(leg), "cell ", i, " has a leg whose length is not finite or is negative");
        require(pair >= 0 && std::cmp_less(pair, model.pairs.size()), "cell ", i, " lists pair ", pair,
                " of ", model.pairs.size());
        require(model.pairs[static_cast<std::size_t>(pair)].carrier == cell.carrier, "cell ", i,
                " lists a pair of another carrier");
    }
}

}  // namespace

void check_certified_model(const CertifiedModel& model, const SphereTree& tree, int vertex_count) {
    constexpr Requirement require("certified tree");
    check_tet_regions(model.regions, static_cast<int>(model.regions.of_tet.size()));
    require(model.cell_begin.size() == tree.nodes.size() + 1 && model.cell_begin.front() == 0 &&
                std::cmp_equal(model.cell_begin.back(), model.cells.size()),
            model.cells.size(), " cells are not divided among ", tree.nodes.size(), " nodes");
    for (std::size_t i = 0; i < tree.nodes.size(); ++i)
        require(model.cell_begin[i] < model.cell_begin[i + 1], "node ", i, " has no cell");
    for (const CertifiedModel::RegionPair& pair : model.pairs)
        for (const int r : {pair.carrier, pair.other})
            require(r >= 0 && r < model.regions.count(), "a pair refers to region ", r, " of ",
                    model.regions.count());
    for (std::size_t i = 0; i < model.cells.size(); ++i) check_cell(model, i, vertex_count);
    require(length(model.rounding) && length(model.reach), "rounding or reach is not finite or is negative");
}

}  // namespace nbd

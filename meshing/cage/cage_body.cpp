#include "meshing/cage/cage_body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <exception>
#include <stdexcept>
#include <utility>

#include "collision/geometry/far_origin.hpp"
#include "meshing/body/embed.hpp"
#include "meshing/surface/edges.hpp"
#include "meshing/surface/material_fill.hpp"
#include "meshing/surface/solid_boundary.hpp"
#include "meshing/tets/order_by_place.hpp"
#include "meshing/tets/tet_quality.hpp"
#include "meshing/tets/tetrahedralize.hpp"

namespace nbd {
namespace {

struct Filled {
    Cage cage;
    TetMesh tets;
    TetOptimization optimization;
    Embedding W;
};

constexpr double tolerance = 0.1;  // of the number of nodes

bool suits(const TetMesh& tets, int nodes) {
    return std::abs(static_cast<double>(tets.X.rows()) - nodes) <= tolerance * nodes;
}

/// Fills a cage with `nodes` nodes, or with as many as fit where the cage is too thin for inner nodes.
TetrahedralizeResult fill_as_possible(const TriMesh& cage, int nodes) {
    try {
        return tetrahedralize(cage, {.nodes = nodes, .tolerance = tolerance});
    } catch (const std::invalid_argument&) {
        return tetrahedralize(cage, {.grading = 0});
    }
}

/// Some cages have faces so close to each other that gmsh fails, that few nodes fit inside, or that rounding
/// puts a vertex outside. Another size and offset then give other faces.
Filled fill(const AlphaWrap& wrap, const TriMesh& soup, int nodes, Elements elements) {
    constexpr std::array<double, 5> offset_shares = {0.25, 0.26, 0.28, 0.22, 0.35};
    double aim = nodes;
    std::exception_ptr failure;  // of the last try; one to find a cage of another aim says less
    for (std::size_t i = 0;; ++i) {
        const int size = std::clamp(static_cast<int>(std::lround(aim)), min_cage_nodes, max_cage_nodes);
        Filled filled;
        try {
            filled.cage = find_cage(wrap, {.nodes = size, .offset_share = offset_shares[i]});
        } catch (const std::invalid_argument&) {
            if (failure) std::rethrow_exception(failure);
            throw;
        }
        try {
            TetrahedralizeResult result = fill_as_possible(filled.cage.surface, nodes);
            filled.tets = std::move(result.tets);
            filled.optimization = result.optimization;
            if (!suits(filled.tets, nodes)) {
                aim *= nodes / static_cast<double>(filled.tets.X.rows());
                throw std::invalid_argument(fmt::format("no cage of {} nodes was found; the nearest has {}",
                                                        nodes, filled.tets.X.rows()));
            }
            filled.tets = as_elements(std::move(filled.tets), elements);
            order_by_place(filled.tets);
            filled.W = embed(filled.tets, soup.X, {.only_inside = true});
            return filled;
        } catch (const std::exception&) {
            if (i + 1 == offset_shares.size()) throw;
            failure = std::current_exception();
        }
    }
}

/// The closed surface of a soup with its faces outward. Throws std::invalid_argument saying why there is
/// none.
TriMesh closed_surface_of(TriMesh soup) {
    const EdgeTable table = edge_table(soup.F);
    for (const EdgeTable::Edge& edge : table.edges)
        if (const auto faces = table.at(edge).size(); faces != 2)
            throw std::invalid_argument(faces == 1 ? "the surface is open"
                                                   : "the surface has edges of more than two faces");
    DisjointSets shells(static_cast<int>(soup.F.rows()));
    for (const EdgeTable::Edge& edge : table.edges) shells.join(table.at(edge)[0] / 3, table.at(edge)[1] / 3);
    // One shell may meet itself; of several, what is a cavity would not be clear.
    if (shells.count() > 1) return make_solid_boundary(std::move(soup), {.allow_components = true}).mesh;
    turn_outward(soup);
    return soup;
}

/// The solid that a soup bounds. Where it does not, `why` says so, and the solid is taken from a close wrap,
/// which does not enter through holes what the cage holds as solid.
TriMesh solid_of(const AlphaWrap& wrap, const TriMesh& soup, const Cage& cage, std::string& why) {
    try {
        return closed_surface_of(soup);
    } catch (const std::invalid_argument& error) {
        why = error.what();
    }
    constexpr double least_alpha = 0.02, most_alpha = 0.2, offset = 0.001, depth = 0.03;  // of its diagonal
    const double size = wrap.box().diagonal().norm();
    for (double alpha = least_alpha;; alpha *= 2) {
        TriMesh close = wrap.wrap(alpha * size, offset * size);
        if (alpha > most_alpha || share_lost(cage.surface, close, wrap, depth * size) <= 0.5) return close;
    }
}

}  // namespace

std::string describe(const CageReport& r) {
    std::string text = fmt::format(
        "{}\n"
        "cage: {} vertices, {} faces, volume {:.6g} m3, of which the body fills {:.6g}; at most {:.3g} m from "
        "the surface (alpha {:.3g} m, offset {:.3g} m)",
        describe(r.soup), r.vertices, r.faces, r.volume, r.material, r.distance, r.alpha, r.offset);
    if (r.closes_holes) text += "; stays coarse where a finer cage would enter the surface through its holes";
    if (r.joins_parts) text += "; stays coarse where a finer cage would fall into parts";
    if (!r.why_wrapped.empty())
        text += fmt::format("\nwhat is solid was taken from a close wrap, as {}", r.why_wrapped);
    if (r.optimization.poor_before > 0) text += fmt::format("\n{}", describe(r.optimization));
    return text;
}

CageBody make_cage_body(std::string name, TriMesh surface, int nodes, const Material& material,
                        Elements elements) {
    check_material(material);
    CageBody result;
    CageReport& report = result.report;
    const Eigen::Vector3d origin = far_origin(surface.X, surface.F);
    surface.X.rowwise() -= origin.transpose();
    report.soup = clean_soup(surface);
    if (nodes < min_cage_nodes || nodes > max_cage_nodes)
        throw std::invalid_argument(
            fmt::format("a cage of {} nodes; allowed: {} to {}", nodes, min_cage_nodes, max_cage_nodes));
    const AlphaWrap wrap(surface);
    Filled filled = fill(wrap, surface, nodes, elements);
    report.vertices = filled.cage.surface.X.rows();
    report.faces = filled.cage.surface.F.rows();
    report.volume = tet_quality(filled.tets).volume;
    static_cast<CageFit&>(report) = filled.cage;
    report.optimization = filled.optimization;

    Body& body = result.body;
    body.name = std::move(name);
    body.origin = origin;
    body.material = material;
    body.surface = std::move(surface);
    body.tets = std::move(filled.tets);
    body.W = std::move(filled.W);
    result.solid = solid_of(wrap, body.surface, filled.cage, report.why_wrapped);
    body.tets.fill = material_fill(body.tets, result.solid);
    for (Eigen::Index t = 0; t < body.tets.T.rows(); ++t)
        report.material += volume(body.tets, t) * body.tets.filled(t);
    check_body(body);
    return result;
}

}  // namespace nbd

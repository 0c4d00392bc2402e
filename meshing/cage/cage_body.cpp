#include "meshing/cage/cage_body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

#include "meshing/body/body_check.hpp"
#include "meshing/body/embed.hpp"
#include "meshing/cage/cage.hpp"
#include "meshing/surface/drop_unreferenced.hpp"
#include "meshing/tets/tet_quality.hpp"
#include "meshing/tets/tetrahedralize.hpp"

namespace nbd {
namespace {

void check_soup(const TriMesh& soup) {
    if (soup.F.rows() == 0) throw std::invalid_argument("the surface has no faces");
    for (int v = 0; v < soup.X.rows(); ++v)
        if (!soup.X.row(v).allFinite())
            throw std::invalid_argument(fmt::format("vertex {} is not finite: ({}, {}, {})", v, soup.X(v, 0),
                                                    soup.X(v, 1), soup.X(v, 2)));
    for (int f = 0; f < soup.F.rows(); ++f)
        for (const int v : soup.F.row(f))
            if (v < 0 || v >= soup.X.rows())
                throw std::invalid_argument(fmt::format(
                    "face {} refers to vertex {}, but the surface has {} vertices", f, v, soup.X.rows()));
}

void check_extent(const TriMesh& soup) {
    const Eigen::RowVector3d least = soup.X.colwise().minCoeff(), most = soup.X.colwise().maxCoeff();
    const double side = (most - least).maxCoeff(),
                 far = std::max(least.cwiseAbs().maxCoeff(), most.cwiseAbs().maxCoeff());
    // Positions are float32 numbers: a smaller surface so far out has no shape.
    if (!(side > 1e-5 * far))
        throw std::invalid_argument(fmt::format(
            "the surface has a longest side of {:.3g} m at up to {:.3g} m from the origin; allowed: "
            "more than 1e-5 of that distance",
            side, far));
}

struct Filled {
    Cage cage;
    TetMesh tets;
    Embedding W;
};

constexpr double tolerance = 0.1;  // of the number of nodes

/// Fills a cage with `nodes` nodes, or with as many as fit where the cage is too thin for inner nodes.
TetMesh fill_as_possible(const TriMesh& cage, int nodes) {
    try {
        return tetrahedralize(cage, {.nodes = nodes, .tolerance = 0.6 * tolerance}).tets;
    } catch (const std::invalid_argument&) {
        return tetrahedralize(cage, {.grading = 0}).tets;
    }
}

/// Fills a cage with slightly different numbers of nodes until no tetrahedron is a sliver, and keeps the
/// best.
TetMesh fill_well(const TriMesh& cage, int nodes) {
    constexpr double good_ratio = 0.05;
    TetMesh best;
    double best_ratio = -1;
    for (const double share : {1., 0.97, 1.03}) {
        TetMesh tets = fill_as_possible(cage, static_cast<int>(std::lround(share * nodes)));
        const double ratio = tet_quality(tets).radius_ratio_min;
        if (ratio > best_ratio) best = std::move(tets), best_ratio = ratio;
        if (ratio >= good_ratio) break;
    }
    return best;
}

/// Some cages have faces so close to each other that gmsh fails, that few nodes fit inside, or that rounding
/// puts a vertex outside. Another size and offset then give other faces.
Filled fill(const SoupWrap& wrap, const TriMesh& soup, int nodes) {
    constexpr std::array<double, 5> offset_shares = {0.25, 0.26, 0.28, 0.22, 0.35};
    double aim = nodes;
    for (std::size_t i = 0;; ++i) {
        const int size = std::clamp(static_cast<int>(std::lround(aim)), min_cage_nodes, max_cage_nodes);
        Filled filled{find_cage(wrap, {.nodes = size, .offset_share = offset_shares[i]}), {}, {}};
        try {
            filled.tets = fill_well(filled.cage.surface, nodes);
            const auto count = static_cast<double>(filled.tets.X.rows());
            if (std::abs(count - nodes) > tolerance * nodes) {
                aim *= nodes / count;
                throw std::invalid_argument(fmt::format("no cage of {} nodes was found; the nearest has {}",
                                                        nodes, filled.tets.X.rows()));
            }
            filled.W = embed(filled.tets, soup.X, {.only_inside = true});
            return filled;
        } catch (const std::exception&) {
            if (i + 1 == offset_shares.size()) throw;
        }
    }
}

}  // namespace

std::string describe(const CageReport& r) {
    std::string text = describe(r.soup);
    if (r.dropped_vertices > 0)
        text += fmt::format("; dropped {} unreferenced {}", r.dropped_vertices,
                            r.dropped_vertices == 1 ? "vertex" : "vertices");
    text += fmt::format(
        "\ncage: {} vertices, {} faces, volume {:.6g} m3; at most {:.3g} m from the surface (alpha {:.3g} m, "
        "offset {:.3g} m)",
        r.vertices, r.faces, r.volume, r.distance, r.alpha, r.offset);
    if (r.closes_holes) text += "; stays coarse where a finer cage would enter the surface through its holes";
    if (r.joins_parts) text += "; stays coarse where a finer cage would fall into parts";
    return text;
}

CageBody make_cage_body(std::string name, TriMesh soup, int nodes, const Material& material) {
    check_material(material);
    check_soup(soup);
    CageBody result;
    CageReport& report = result.report;
    report.dropped_vertices = drop_unreferenced(soup);
    check_extent(soup);
    report.soup = soup_report(soup);
    if (nodes < min_cage_nodes || nodes > max_cage_nodes)
        throw std::invalid_argument(
            fmt::format("a cage of {} nodes; allowed: {} to {}", nodes, min_cage_nodes, max_cage_nodes));
    Filled filled = fill(SoupWrap(soup), soup, nodes);
    report.vertices = static_cast<int>(filled.cage.surface.X.rows());
    report.faces = static_cast<int>(filled.cage.surface.F.rows());
    report.volume = tet_quality(filled.tets).volume;
    report.alpha = filled.cage.alpha;
    report.offset = filled.cage.offset;
    report.distance = filled.cage.distance;
    report.closes_holes = filled.cage.closes_holes;
    report.joins_parts = filled.cage.joins_parts;

    Body& body = result.body;
    body.name = std::move(name);
    body.material = material;
    body.surface = std::move(soup);
    body.tets = std::move(filled.tets);
    body.W = std::move(filled.W);
    check_body(body);
    return result;
}

}  // namespace nbd

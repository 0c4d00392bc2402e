#include "meshing/cage/cage_body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
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

/// Some cages have faces so close to each other that gmsh fails or that rounding puts a vertex outside.
/// Another offset then gives other faces.
Filled fill(const SoupWrap& wrap, const TriMesh& soup, int nodes) {
    constexpr std::array<double, 4> offset_shares = {0.25, 0.3, 0.2, 0.4};
    for (std::size_t i = 0;; ++i) {
        Filled filled{find_cage(wrap, {.nodes = nodes, .offset_share = offset_shares[i]}), {}, {}};
        try {
            filled.tets = tetrahedralize(filled.cage.surface, {.nodes = nodes, .tolerance = 0.1}).tets;
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

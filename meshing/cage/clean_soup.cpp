#include "meshing/cage/clean_soup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "meshing/surface/drop_unreferenced.hpp"

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

/// Drops faces that repeat a vertex: they have no area, and their edges seem to belong to too many faces.
void drop_repeating_faces(Faces& F) {
    int kept = 0;
    for (int f = 0; f < F.rows(); ++f)
        if (F(f, 0) != F(f, 1) && F(f, 1) != F(f, 2) && F(f, 2) != F(f, 0)) F.row(kept++) = F.row(f).eval();
    F.conservativeResize(kept, 3);
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

}  // namespace

std::string describe(const CleanSoupReport& r) {
    std::string text = "surface: " + describe(r.given);
    if (r.given.repeating_faces > 0) text += "; dropped the faces that repeat a vertex";
    if (r.dropped_vertices > 0)
        text += fmt::format("; dropped {} unreferenced {}", r.dropped_vertices,
                            r.dropped_vertices == 1 ? "vertex" : "vertices");
    return text;
}

CleanSoupReport clean_soup(TriMesh& soup) {
    check_soup(soup);
    CleanSoupReport report{soup_report(soup)};
    drop_repeating_faces(soup.F);
    if (soup.F.rows() == 0)
        throw std::invalid_argument(fmt::format("all faces repeat a vertex ({})", report.given.faces));
    report.dropped_vertices = drop_unreferenced(soup);
    check_extent(soup);
    return report;
}

}  // namespace nbd

#pragma once

#include <string>

#include "meshing/body/body.hpp"
#include "meshing/cage/cage.hpp"
#include "meshing/cage/clean_soup.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "meshing/tets/optimize_tets.hpp"

namespace nbd {

/// How a cage came about, for people.
struct CageReport : CageFit {
    SoupReport soup;
    int vertices = 0, faces = 0;
    double volume = 0;        // of the cage, m3
    double material = 0;      // of the solid in it, m3
    std::string why_wrapped;  // that solid is of a close wrap, as the surface does not bound one; or empty
    TetOptimization optimization;
};

/// Two lines: the soup with its defects, and the cage. A third one if tetrahedra were optimised.
std::string describe(const CageReport& report);

struct CageBody {
    Body body;
    CageReport report;
    TriMesh solid;  // that fills the tetrahedra, as material_fill() takes it
};

/// Makes a body of any triangle soup: fills a coarse closed cage around it with tetrahedra of `nodes`
/// corners, within 10 %, and embeds the soup after clean_soup(). All weights are >= 0. Mass and stiffness are
/// those of the solid that the soup bounds; where it is open, or several shells meet, of a close wrap, a
/// thousandth of its diagonal outside, without gaps below a twenty-fifth and without cavities. The body has
/// no modes yet. surface: may be open, non-manifold and self-intersecting. Throws std::invalid_argument as
/// clean_soup() does, for a material or number of nodes out of range, and for a soup that no cage of so many
/// nodes holds; std::runtime_error if gmsh cannot fill the cage.
CageBody make_cage_body(std::string name, TriMesh surface, int nodes, const Material& material = {},
                        Elements elements = Elements::linear);

}  // namespace nbd

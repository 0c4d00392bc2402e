#include "meshing/cage/body_inside.hpp"

#include <utility>

#include "meshing/body/body_check.hpp"
#include "meshing/body/embed.hpp"

namespace nbd {

Body make_body_inside(std::string name, TriMesh surface, const Body& outer) {
    Body body;
    body.name = std::move(name);
    body.origin = outer.origin;
    surface.X.rowwise() -= outer.origin.transpose();
    body.material = outer.material;
    body.regions = outer.regions;
    body.W = embed(outer.tets, surface.X, {.only_inside = true});
    body.surface = std::move(surface);
    body.tets = outer.tets;
    check_body(body);
    return body;
}

}  // namespace nbd

#include "meshing/body/make_body.hpp"

#include <utility>

#include "collision/geometry/far_origin.hpp"
#include "meshing/body/embed.hpp"

namespace nbd {

TriMesh boundary_surface(const TetMesh& tets) {
    TriMesh surface{tets.X, boundary_faces(tets)};
    drop_unreferenced(surface);
    return surface;
}

Body make_body(std::string name, const TriMesh& surface, TetMesh tets, const Material& material, int levels,
               SubdivisionScheme scheme) {
    check_material(material);
    Body body;
    body.name = std::move(name);
    body.material = material;
    body.origin = far_origin(surface.X, surface.F);
    TriMesh near = surface;  // like the tetrahedra, counted from the origin
    if (!body.origin.isZero(0)) {
        near.X.rowwise() -= body.origin.transpose();
        tets.X.rowwise() -= body.origin.transpose();
    }
    Subdivision fine = subdivide(near, scheme, levels);
    body.surface = std::move(fine.mesh);
    // Inside faces of quadratic tetrahedra, what lies on them in every pose is no mean of corners.
    const bool is_curved = tets.is_quadratic() && levels > 0 && scheme == SubdivisionScheme::midpoint;
    body.W = is_curved ? embed(tets, body.surface.X) : Embedding(fine.S * embed(tets, near.X));
    body.tets = std::move(tets);
    check_body(body);
    return body;
}

Body make_body(std::string name, TetMesh tets, const Material& material, int levels,
               SubdivisionScheme scheme) {
    const TriMesh surface = boundary_surface(tets);
    return make_body(std::move(name), surface, std::move(tets), material, levels, scheme);
}

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

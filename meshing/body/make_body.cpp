#include "meshing/body/make_body.hpp"

#include <utility>
#include <vector>

#include "collision/geometry/far_origin.hpp"
#include "meshing/body/body_check.hpp"
#include "meshing/body/embed.hpp"

namespace nbd {

TriMesh boundary_surface(const TetMesh& tets) {
    TriMesh surface{{}, boundary_faces(tets)};
    std::vector<int> row(tets.X.rows(), -1);
    for (const int node : surface.F.reshaped()) row[node] = 0;
    surface.X.resize(tets.X.rows(), 3);
    int count = 0;
    for (int node = 0; node < tets.X.rows(); ++node) {
        if (row[node] < 0) continue;
        surface.X.row(count) = tets.X.row(node);
        row[node] = count++;
    }
    surface.X.conservativeResize(count, 3);
    for (int& corner : surface.F.reshaped()) corner = row[corner];
    return surface;
}

namespace {

/// Completes a body whose surface and tetrahedra are counted from its origin.
Body make_near_body(Body body, const TriMesh& surface, TetMesh tets, int levels, SubdivisionScheme scheme) {
    Subdivision fine = subdivide(surface, scheme, levels);
    body.surface = std::move(fine.mesh);
    body.W = fine.S * embed(tets, surface.X);
    body.tets = std::move(tets);
    check_body(body);
    return body;
}

}  // namespace

Body make_body(std::string name, const TriMesh& surface, TetMesh tets, const Material& material, int levels,
               SubdivisionScheme scheme) {
    check_material(material);
    Body body;
    body.name = std::move(name);
    body.material = material;
    body.origin = far_origin(surface.X, surface.F);
    if (!body.origin.isZero(0)) {
        TriMesh near{surface.X.rowwise() - body.origin.transpose(), surface.F};
        tets.X.rowwise() -= body.origin.transpose();
        return make_near_body(std::move(body), near, std::move(tets), levels, scheme);
    }
    return make_near_body(std::move(body), surface, std::move(tets), levels, scheme);
}

Body make_body(std::string name, TetMesh tets, const Material& material, int levels,
               SubdivisionScheme scheme) {
    const TriMesh surface = boundary_surface(tets);
    return make_body(std::move(name), surface, std::move(tets), material, levels, scheme);
}

}  // namespace nbd

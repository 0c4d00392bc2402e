#include "tests/support/box_body.hpp"

#include <utility>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd::test {

Body boundary_body(TetMesh tets, const Material& material) {
    Body body;
    body.name = "box";
    body.material = material;
    const Faces outer = boundary_faces(tets);
    std::vector<int> vertex(tets.X.rows(), -1), nodes;
    body.surface.F.resize(outer.rows(), 3);
    for (Eigen::Index f = 0; f < outer.rows(); ++f)
        for (int k = 0; k < 3; ++k) {
            int& v = vertex[outer(f, k)];
            if (v < 0) {
                v = nodes.size();
                nodes.push_back(outer(f, k));
            }
            body.surface.F(f, k) = v;
        }
    body.surface.X = tets.X(nodes, Eigen::all);
    body.W.resize(nodes.size(), tets.X.rows());
    for (std::size_t v = 0; v < nodes.size(); ++v) body.W.insert(v, nodes[v]) = 1;
    body.W.makeCompressed();
    body.tets = std::move(tets);
    return body;
}

Body box_body(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, const Material& material) {
    TetMesh tets = box_mesh(size, cells);
    tets.X.rowwise() -= size.transpose() / 2;
    return boundary_body(std::move(tets), material);
}

Body fine_box_body(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, int levels,
                   const Material& material) {
    Body body = box_body(size, cells, material);
    const Subdivision fine = subdivide(body.surface, SubdivisionScheme::midpoint, levels);
    body.W = (fine.S * body.W).eval();
    body.surface = fine.mesh;
    return body;
}

}  // namespace nbd::test

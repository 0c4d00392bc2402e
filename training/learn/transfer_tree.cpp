#include "training/learn/transfer_tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "collision/base/stop.hpp"
#include "collision/geometry/closest_points.hpp"
#include "meshing/parallel/parallel_for.hpp"

namespace nbd {

namespace {

/// Finds the leaf whose part of the rest surface is nearest to a point.
class NearestLeaf {
 public:
    explicit NearestLeaf(const TreeFile& file)
        : tree_(file.tree.spheres), faces_(file.tree.faces), X_(file.X) {}

    int find(const Eigen::Vector3d& p) const {
        Best best;
        visit(0, p, best);
        return best.leaf;
    }

 private:
    struct Best {
        int leaf = 0;
        double distance = std::numeric_limits<double>::infinity();
    };

    double gap(int node, const Eigen::Vector3d& p) const {
        const Sphere& s = tree_.rest[node];
        return (p - s.c.cast<double>()).norm() - static_cast<double>(s.r);
    }

    void visit(int node, const Eigen::Vector3d& p, Best& best) const {
        const SphereTree::Node& n = tree_.nodes[node];
        if (!n.is_leaf()) {
            int near = n.first_child, far = near + 1;
            if (gap(far, p) < gap(near, p)) std::swap(near, far);
            for (const int child : {near, far})
                if (gap(child, p) < best.distance) visit(child, p, best);
            return;
        }
        for (const int f : tree_.node_faces(node)) {
            const auto corner = [&](int k) -> Eigen::Vector3d {
                return X_.row(faces_(f, k)).transpose().cast<double>();
            };
            const double distance = closest_point_triangle(p, corner(0), corner(1), corner(2)).distance;
            if (distance < best.distance) best = {node, distance};
        }
    }

    const SphereTree& tree_;
    const Faces& faces_;
    const Vertices& X_;
};

std::vector<int> leaves_of_faces(const TreeFile& trained, const SurfaceBody& body) {
    const NearestLeaf nearest(trained);
    std::vector<int> leaves(body.F.rows());
    parallel_for(leaves.size(), [&](int f) {
        stop_if_asked();
        Eigen::Vector3d middle = Eigen::Vector3d::Zero();
        for (const int v : body.F.row(f)) middle += body.X.row(v).transpose().cast<double>() / 3;
        leaves[f] = nearest.find(middle);
    });
    return leaves;
}

/// Replaces vertices of the trained surface by the nearest ones of the other. Returns each distance, metres.
std::vector<float> move_vertices(const TreeFile& trained, const SurfaceBody& body,
                                 std::vector<int>& vertices) {
    std::vector<float> moved(vertices.size());
    parallel_for(
        vertices.size(),
        [&](int i) {
            stop_if_asked();
            Eigen::Index nearest = 0;
            const std::size_t k = i;
            const float squared =
                (body.X.rowwise() - trained.X.row(vertices[k])).rowwise().squaredNorm().minCoeff(&nearest);
            vertices[k] = nearest;
            moved[k] = std::sqrt(squared);
        },
        64);
    return moved;
}

/// Transfers the networks. They give the same spheres for the same z, so the output centres absorb the
/// difference between the two surfaces' rest spheres.
NbdModel move_nbd(const TreeFile& trained, const SurfaceBody& body, const SphereTree& spheres) {
    NbdModel model = *trained.tree.nbd;
    std::vector<int>& representatives = model.modes.representatives;
    const std::vector<float> moved = move_vertices(trained, body, representatives);
    const float most = *std::max_element(moved.begin(), moved.end()), radius = trained.tree.spheres.rest[0].r;
    if (most > 0.1f * radius)
        throw std::invalid_argument(
            fmt::format("a representative is {:.3g} m from the surface's nearest vertex; allowed: "
                        "a tenth of the body's radius, which is {:.3g} m; is this another surface?",
                        most, radius));
    model.modes.X = body.X(representatives, Eigen::all);
    for (std::size_t i = 0; i < spheres.rest.size(); ++i) {
        const Sphere &before = trained.tree.spheres.rest[i], &after = spheres.rest[i];
        const Eigen::Index column = i;
        model.out_centre.block<3, 1>(0, column) += before.c - after.c;
        model.out_centre(3, column) += before.r - after.r;
    }
    return model;
}

}  // namespace

TreeFile transfer_tree(const TreeFile& trained, const SurfaceBody& body) {
    if (!trained.tree.nbd) throw std::invalid_argument("the tree has no nbd bounds to transfer");
    TreeFile file;
    file.X = body.X;
    file.W = body.W;
    CollisionTree& tree = file.tree;
    tree.vertex_count = body.X.rows();
    tree.faces = body.F;
    tree.spheres = sphere_tree_like(trained.tree.spheres, leaves_of_faces(trained, body), body.X, body.F);
    tree.nbd = move_nbd(trained, body, tree.spheres);
    hang_on_solid(tree, body);
    const auto calibration = trained.tree.calibrations.find(BoundKind::nbd);
    if (calibration != trained.tree.calibrations.end()) tree.calibrations.insert(*calibration);
    file.facts = trained.facts;
    file.facts.body_hash = body.hash;
    file.facts.node_loss.resize(0);
    return file;
}

}  // namespace nbd

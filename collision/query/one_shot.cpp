#include "collision/query/one_shot.hpp"

#include <algorithm>
#include <stdexcept>

#include "collision/base/message.hpp"
#include "collision/geometry/far_origin.hpp"
#include "collision/query/pair_query.hpp"

namespace nbd {
namespace {

/// The surface as a tree in its pose. name: for errors. x must outlive the result.
PosedTree posed(const char* name, const VerticesRef& x, const FacesRef& F) {
    if (F.rows() == 0) throw std::invalid_argument(message("surface ", name, " has no faces"));
    try {
        PosedTree tree(shared_exact_tree(x, F), BoundKind::boxes);
        tree.begin_pose(VertexView::as_long_as(x));
        return tree;
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(message("surface ", name, ": ", error.what()));
    }
}

/// Throws unless far_origin() can measure the surface.
void check(const char* name, const NodesRef& x, const FacesRef& F) {
    if (F.rows() == 0) throw std::invalid_argument(message("surface ", name, " has no faces"));
    if (F.minCoeff() < 0 || F.maxCoeff() >= x.rows())
        throw std::invalid_argument(message("surface ", name, ": a face refers to vertex ",
                                            F.minCoeff() < 0 ? F.minCoeff() : F.maxCoeff(),
                                            ", but there are ", x.rows(), " vertices"));
    if (!x.allFinite()) throw std::invalid_argument(message("surface ", name, ": a position is not finite"));
}

Vertices from(const Eigen::Vector3d& origin, const NodesRef& x) {
    return (x.rowwise() - origin.transpose()).cast<float>();
}

/// The origin that both surfaces are counted from.
Eigen::Vector3d common_origin(NodesRef xa, FacesRef fa, NodesRef xb, FacesRef fb) {
    check("a", xa, fa);
    check("b", xb, fb);
    Eigen::AlignedBox3d box;
    for (const NodesRef* x : {&xa, &xb})
        for (Eigen::Index v = 0; v < x->rows(); ++v) box.extend(x->row(v).transpose());
    return far_origin(box, std::min(mean_edge(xa, fa), mean_edge(xb, fb)));
}

std::vector<FacePair> copied(std::span<const FacePair> pairs) { return {pairs.begin(), pairs.end()}; }

}  // namespace

std::vector<FacePair> intersecting_faces(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb) {
    PosedTree a = posed("a", xa, fa), b = posed("b", xb, fb);
    return copied(PairQuery().intersecting(a, b));
}

std::vector<FacePair> face_pairs_within(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb,
                                        float distance) {
    require_distance(distance);
    PosedTree a = posed("a", xa, fa), b = posed("b", xb, fb);
    return copied(PairQuery().within(a, b, distance));
}

ClosestFaces closest_points(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb) {
    PosedTree a = posed("a", xa, fa), b = posed("b", xb, fb);
    // Posed surfaces with a face each are a finite distance apart.
    return ClosestQuery().closest(a, b).value();
}

std::vector<FacePair> intersecting_faces(NodesRef xa, FacesRef fa, NodesRef xb, FacesRef fb) {
    const Eigen::Vector3d origin = common_origin(xa, fa, xb, fb);
    return intersecting_faces(from(origin, xa), fa, from(origin, xb), fb);
}

std::vector<FacePair> face_pairs_within(NodesRef xa, FacesRef fa, NodesRef xb, FacesRef fb, float distance) {
    const Eigen::Vector3d origin = common_origin(xa, fa, xb, fb);
    return face_pairs_within(from(origin, xa), fa, from(origin, xb), fb, distance);
}

ClosestFaces closest_points(NodesRef xa, FacesRef fa, NodesRef xb, FacesRef fb) {
    const Eigen::Vector3d origin = common_origin(xa, fa, xb, fb);
    ClosestFaces found = closest_points(from(origin, xa), fa, from(origin, xb), fb);
    found.points.a += origin;
    found.points.b += origin;
    return found;
}

}  // namespace nbd

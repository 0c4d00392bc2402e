#include "collision/query/one_shot.hpp"

#include <cmath>
#include <stdexcept>

#include "collision/base/message.hpp"
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

std::vector<FacePair> copied(std::span<const FacePair> pairs) { return {pairs.begin(), pairs.end()}; }

}  // namespace

std::vector<FacePair> intersecting_faces(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb) {
    PosedTree a = posed("a", xa, fa), b = posed("b", xb, fb);
    return copied(PairQuery().intersecting(a, b));
}

std::vector<FacePair> face_pairs_within(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb,
                                        float distance) {
    if (!(distance >= 0 && std::isfinite(distance)))
        throw std::invalid_argument(message("distance is ", distance, " m, allowed: finite, 0 or more"));
    PosedTree a = posed("a", xa, fa), b = posed("b", xb, fb);
    return copied(PairQuery().within(a, b, distance));
}

ClosestFaces closest_points(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb) {
    PosedTree a = posed("a", xa, fa), b = posed("b", xb, fb);
    // Posed surfaces with a face each are a finite distance apart.
    return ClosestQuery().closest(a, b).value();
}

}  // namespace nbd

#include "collision/query/near_at_rest.hpp"

#include "collision/query/self_query.hpp"

namespace nbd {

std::shared_ptr<const FacePairSet> near_at_rest(VerticesRef X, FacesRef F, float distance) {
    require_distance(distance);
    PosedTree body(shared_exact_tree(X, F), BoundKind::boxes);
    body.begin_pose(VertexView::as_long_as(X));
    return std::make_shared<const FacePairSet>(SelfQuery().within(body, distance), F.rows());
}

}  // namespace nbd

#pragma once

#include <cstdint>
#include <memory>

#include "collision/geometry/embedding.hpp"
#include "collision/geometry/tet_mesh.hpp"
#include "collision/query/self_query.hpp"

namespace nbd {

/// Counts the faces of one surface that intersect each other, in one pose after another.
class SelfIntersections {
 public:
    /// tree: of the surface, with exact bounds.
    explicit SelfIntersections(std::shared_ptr<const CollisionTree> tree)
        : posed_(std::move(tree), BoundKind::boxes) {}

    /// Pairs of faces without a common vertex that have a point in common, by exact tests of positions in
    /// single precision, from nodes as a recording has them. W: of the surface; nodes: [N, 3], metres.
    std::int32_t count(const Embedding& W, const Nodes& nodes) {
        const Vertices x = embedded(W, Nodes(nodes.cast<float>().cast<double>())).cast<float>();
        posed_.begin_pose(x);
        return query_.intersecting(posed_).size();
    }

 private:
    PosedTree posed_;
    SelfQuery query_;
};

}  // namespace nbd

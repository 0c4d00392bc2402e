// 07: Which faces of a skinned body touch, those of another body and its own, now and during a step?
//
//     build/release/apps/examples/07_skin_on_bones
//
// A surface under linear blend skinning hangs on nodes, four for each bone. `affine` bounds read these nodes
// and compute positions only of the faces that may touch: the skin itself is never computed as a whole.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "apps/examples/ball.hpp"
#include "collision/geometry/skinning.hpp"
#include "collision/query/one_shot.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"

constexpr int bones = 5;

// A finger along z: a stretched ball. Each vertex follows the two bones around it.
static Surface finger() {
    Surface s = ball(0.15f);
    s.x.col(2) *= 8;
    return s;
}
static nbd::SurfaceEmbedding bone_weights(const nbd::Vertices& x) {
    nbd::SurfaceEmbedding weights(x.rows(), bones);
    for (int v = 0; v < x.rows(); ++v) {
        const float along = (x(v, 2) / 2.4f + 0.5f) * (bones - 1);
        const int below = std::min(static_cast<int>(along), bones - 2);
        weights.insert(v, below) = 1 - (along - static_cast<float>(below));
        weights.insert(v, below + 1) = along - static_cast<float>(below);
    }
    return weights;
}

// The bones' transforms: the finger curls by an angle at each joint. A program that animates has these
// already: each bone's transform times the inverse of its bind transform.
static std::vector<nbd::BoneTransform> curled(float angle) {
    std::vector<nbd::BoneTransform> transforms;
    nbd::BoneTransform M = nbd::BoneTransform::Identity();
    for (int bone = 0; bone < bones; ++bone) {
        transforms.push_back(M);
        const Eigen::Vector3f joint(0, 0, 2.4f * (static_cast<float>(bone) / (bones - 1) - 0.5f));
        const float c = std::cos(angle), s = std::sin(angle);
        Eigen::Matrix3f turn;
        turn << c, 0, s, 0, 1, 0, -s, 0, c;
        M.col(3) += M.leftCols<3>() * (joint - turn * joint);
        M.leftCols<3>() = (M.leftCols<3>() * turn).eval();
    }
    return transforms;
}

int main() {
    // Once: the skin as a surface on nodes, and a tree with `affine` bounds.
    const Surface s = finger(), obstacle = ball(0.4f);
    const nbd::Skinning skin(s.x, bone_weights(s.x));
    nbd::CollisionTree tree = nbd::make_exact_tree(s.x, s.F);
    nbd::hang_on_nodes(tree, skin.embedding(), skin.rest_nodes());
    nbd::PosedTree body(std::make_shared<const nbd::CollisionTree>(std::move(tree)), nbd::BoundKind::affine);
    nbd::PosedTree other(nbd::shared_exact_tree(obstacle.x, obstacle.F), nbd::BoundKind::boxes);
    const nbd::Vertices there = obstacle.x.rowwise() + Eigen::RowVector3f(0.9f, 0, 0);
    other.begin_pose(there);
    nbd::PairQuery query;
    // Faces that are close to each other in the rest pose are no self-contact.
    nbd::SelfQuery self(nbd::near_at_rest(s.x, s.F, 0.1f));

    // Every frame: the bones, then the nodes, then the queries.
    bool right = true;
    std::size_t touching = 0, own = 0;
    nbd::Vertices nodes, nodes_before;
    skin.pose(curled(0), nodes_before);
    for (int frame = 0; frame <= 12; ++frame) {
        skin.pose(curled(0.14f * static_cast<float>(frame)), nodes);
        body.begin_step_of_nodes(nodes_before, nodes);  // from one frame to the next, moving straight
        const std::size_t candidates = query.boxes_within(body, other, 0).size();
        body.begin_pose_of_nodes(nodes);
        const std::size_t pairs = query.intersecting(body, other).size(),
                          contacts = self.within(body, 0.02f).size();
        if (frame % 2 == 0)
            std::printf(
                "frame %2d: %4zu pairs of faces touch, %5zu may have since the last frame; "
                "%4zu of its own are 2 cm apart\n",
                frame, pairs, candidates, contacts);
        const nbd::Vertices x = nbd::embedded(skin.embedding(), nodes);  // to compare
        right &= pairs == nbd::intersecting_faces(x, s.F, there, obstacle.F).size() && candidates >= pairs;
        touching += pairs;
        own += contacts;
        nodes_before = nodes;
    }
    return right && touching > 100 && own > 100 ? 0 : 1;
}

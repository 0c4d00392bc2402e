#include <BulletCollision/Gimpact/btGImpactBvh.h>

#include "apps/bench/peers/candidates.hpp"
#include "apps/bench/peers/peers.hpp"
#include "collision/geometry/box.hpp"

namespace nbd {
namespace {

btVector3 to_bullet(const Eigen::Vector3f& p) { return {p.x(), p.y(), p.z()}; }

/// GImpact's tree over the faces' own boxes. GImpact's mesh shapes would add a margin, which floods the
/// query.
class GimpactFaces final : public btPrimitiveManagerBase {
 public:
    explicit GimpactFaces(const SurfaceBody& body) : faces_{&body.F, body.X}, tree_(this) {
        tree_.buildSet();
    }
    GimpactFaces(const GimpactFaces&) = delete;
    GimpactFaces& operator=(const GimpactFaces&) = delete;

    void update(const VerticesRef& x) {
        faces_.x = VertexView::as_long_as(x);
        tree_.update();
    }
    btGImpactBvh& tree() { return tree_; }
    const PosedFaces& faces() const { return faces_; }

    bool is_trimesh() const override { return true; }
    int get_primitive_count() const override { return static_cast<int>(faces_.F->rows()); }
    void get_primitive_box(int face, btAABB& box) const override {
        const Box bounds = bounding_box(faces_.triangle(face));
        box.m_min = btVector3(bounds.lo[0], bounds.lo[1], bounds.lo[2]);
        box.m_max = btVector3(bounds.hi[0], bounds.hi[1], bounds.hi[2]);
    }
    void get_primitive_triangle(int face, btPrimitiveTriangle& triangle) const override {
        const Triangle t = faces_.triangle(face);
        triangle.m_vertices[0] = to_bullet(t.a);
        triangle.m_vertices[1] = to_bullet(t.b);
        triangle.m_vertices[2] = to_bullet(t.c);
    }

 private:
    PosedFaces faces_;
    btGImpactBvh tree_;
};

class GimpactPairs final : public PairMethod {
 public:
    explicit GimpactPairs(const BenchBody& body) : a_(body.surface), b_(body.surface) {}

    void update(const BenchPose& a, const BenchPose& b) override {
        a_.update(a.x);
        b_.update(b.x);
    }
    std::span<const FacePair> query() override {
        pairs_.resize(0);
        const btTransform identity = btTransform::getIdentity();
        btGImpactBvh::find_collision(&a_.tree(), identity, &b_.tree(), identity, pairs_);
        candidates_.clear();
        for (int i = 0; i < pairs_.size(); ++i)
            candidates_.push_back({pairs_[i].m_index1, pairs_[i].m_index2});
        return sorted_intersecting(candidates_, a_.faces(), b_.faces());
    }

 private:
    GimpactFaces a_, b_;
    btPairSet pairs_;
    std::vector<FacePair> candidates_;
};

}  // namespace

std::unique_ptr<PairMethod> make_bullet_gimpact_pairs(const BenchBody& body) {
    return std::make_unique<GimpactPairs>(body);
}

}  // namespace nbd

#include <BulletCollision/BroadphaseCollision/btDbvt.h>

#include <cstdint>

#include "apps/bench/peers/candidates.hpp"
#include "apps/bench/peers/peers.hpp"
#include "collision/geometry/box.hpp"

namespace nbd {
namespace {

btDbvtVolume volume_of(const Triangle& t) {
    const Box box = bounding_box(t);
    return btDbvtVolume::FromMM({box.lo[0], box.lo[1], box.lo[2]}, {box.hi[0], box.hi[1], box.hi[2]});
}

/// The tree in which Bullet's soft bodies keep their faces, built once top-down. Soft bodies insert every
/// face again in each pose; refitting the existing volumes, as here, is far faster.
class DbvtFaces {
 public:
    explicit DbvtFaces(const SurfaceBody& body) : faces_{&body.F, body.X} {
        for (std::intptr_t f = 0; f < body.F.rows(); ++f)
            tree_.insert(volume_of(faces_.triangle(static_cast<int>(f))), reinterpret_cast<void*>(f));
        tree_.optimizeTopDown();
        children_last(tree_.m_root);
    }
    DbvtFaces(const DbvtFaces&) = delete;
    DbvtFaces& operator=(const DbvtFaces&) = delete;

    void update(const VerticesRef& x) {
        faces_.x = VertexView::as_long_as(x);
        for (std::size_t i = order_.size(); i-- > 0;) {
            btDbvtNode* node = order_[i];
            if (node->isleaf())
                node->volume = volume_of(faces_.triangle(face_of(node)));
            else
                Merge(node->childs[0]->volume, node->childs[1]->volume, node->volume);
        }
    }
    static int face_of(const btDbvtNode* leaf) {
        return static_cast<int>(reinterpret_cast<std::intptr_t>(leaf->data));
    }
    btDbvt& tree() { return tree_; }
    const PosedFaces& faces() const { return faces_; }

 private:
    void children_last(btDbvtNode* node) {
        order_.push_back(node);
        if (node->isleaf()) return;
        children_last(node->childs[0]);
        children_last(node->childs[1]);
    }

    PosedFaces faces_;
    btDbvt tree_;
    std::vector<btDbvtNode*> order_;
};

class DbvtPairs final : public PairMethod, private btDbvt::ICollide {
 public:
    explicit DbvtPairs(const BenchBody& body) : a_(body.surface), b_(body.surface) {}

    void update(const BenchPose& a, const BenchPose& b) override {
        a_.update(a.x);
        b_.update(b.x);
    }
    std::span<const FacePair> query() override {
        candidates_.clear();
        a_.tree().collideTT(a_.tree().m_root, b_.tree().m_root, *this);
        return sorted_intersecting(candidates_, a_.faces(), b_.faces());
    }

 private:
    void Process(const btDbvtNode* a, const btDbvtNode* b) override {
        candidates_.push_back({DbvtFaces::face_of(a), DbvtFaces::face_of(b)});
    }

    DbvtFaces a_, b_;
    std::vector<FacePair> candidates_;
};

}  // namespace

std::unique_ptr<PairMethod> make_bullet_dbvt_pairs(const BenchBody& body) {
    return std::make_unique<DbvtPairs>(body);
}

}  // namespace nbd

// clang-format off: utility.h must come first, since the others use its fit() before they declare it.
#include <fcl/math/bv/utility.h>
// clang-format on
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/detail/traversal/collision/bvh_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/traversal_recurse.h>

#include <stdexcept>

#include "apps/bench/peers/candidates.hpp"
#include "apps/bench/peers/peers.hpp"

namespace nbd {
namespace {

// float32 like the poses. The templates are then compiled here, with this program's alignment of Eigen types.
using Model = fcl::BVHModel<fcl::AABBf>;

/// Collects the faces of leaves with overlapping boxes instead of testing them.
class Collector final : public fcl::detail::BVHCollisionTraversalNode<fcl::AABBf> {
 public:
    Collector(const Model& a, const Model& b, std::vector<FacePair>& out) : out_(out) {
        model1 = &a;
        model2 = &b;
    }
    void leafTesting(int a, int b) const override {
        out_.push_back({model1->getBV(a).primitiveId(), model2->getBV(b).primitiveId()});
    }

 private:
    std::vector<FacePair>& out_;
};

/// A model with one box per face, whose tree is refitted bottom-up in each pose.
class FclFaces {
 public:
    explicit FclFaces(const SurfaceBody& body) : faces_{&body.F, body.X} {
        positions_.resize(static_cast<std::size_t>(body.X.rows()));
        copy(body.X);
        std::vector<fcl::Triangle> triangles;
        for (Eigen::Index f = 0; f < body.F.rows(); ++f)
            triangles.emplace_back(body.F(f, 0), body.F(f, 1), body.F(f, 2));
        if (model_.beginModel(static_cast<int>(body.F.rows()), static_cast<int>(body.X.rows())) !=
                fcl::BVH_OK ||
            model_.addSubModel(positions_, triangles) != fcl::BVH_OK || model_.endModel() != fcl::BVH_OK)
            throw std::runtime_error("fcl rejects the surface");
    }

    void update(const VerticesRef& x) {
        faces_.x = VertexView::as_long_as(x);
        copy(x);
        model_.beginReplaceModel();
        model_.replaceSubModel(positions_);
        model_.endReplaceModel(true, true);
    }
    const Model& model() const { return model_; }
    const PosedFaces& faces() const { return faces_; }

 private:
    void copy(VerticesRef x) {
        for (Eigen::Index v = 0; v < x.rows(); ++v)
            positions_[static_cast<std::size_t>(v)] = x.row(v).transpose();
    }

    PosedFaces faces_;
    Model model_;
    std::vector<fcl::Vector3f> positions_;
};

/// Uses the traversal directly, since fcl::collide() would copy both models per query to apply a transform.
class FclPairs final : public PairMethod {
 public:
    explicit FclPairs(const BenchBody& body) : a_(body.surface), b_(body.surface) {}

    void update(const BenchPose& a, const BenchPose& b) override {
        a_.update(a.x);
        b_.update(b.x);
    }
    std::span<const FacePair> query() override {
        candidates_.clear();
        Collector collector(a_.model(), b_.model(), candidates_);
        fcl::detail::collisionRecurse(&collector, 0, 0, nullptr);
        return sorted_intersecting(candidates_, a_.faces(), b_.faces());
    }

 private:
    FclFaces a_, b_;
    std::vector<FacePair> candidates_;
};

}  // namespace

std::unique_ptr<PairMethod> make_fcl_pairs(const BenchBody& body) { return std::make_unique<FclPairs>(body); }

}  // namespace nbd

#include "apps/bench/pairs/pair_method.hpp"

#ifdef NBD_WITH_EMBREE
#include <embree3/rtcore.h>

#include <algorithm>

#include "collision/geometry/box.hpp"
#include "collision/query/narrow_phase.hpp"

namespace nbd {
namespace {

/// rtcCollide() accepts only user geometry: one box per face, from its three corners. A dynamic scene of low
/// build quality with geometry that is refitted: a pose moves the boxes alone.
class EmbreeScene {
 public:
    EmbreeScene(RTCDevice device, const SurfaceBody& body) : faces_{&body.F, body.X} {
        scene_ = rtcNewScene(device);
        rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
        rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_LOW);
        geometry_ = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryBuildQuality(geometry_, RTC_BUILD_QUALITY_REFIT);
        rtcSetGeometryUserPrimitiveCount(geometry_, body.F.rows());
        rtcSetGeometryUserData(geometry_, this);
        rtcSetGeometryBoundsFunction(geometry_, bound_face, nullptr);
        rtcCommitGeometry(geometry_);
        rtcAttachGeometry(scene_, geometry_);
        rtcCommitScene(scene_);
    }
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;
    ~EmbreeScene() {
        rtcReleaseGeometry(geometry_);
        rtcReleaseScene(scene_);
    }

    void update(const VerticesRef& x) {
        faces_.x = VertexView::as_long_as(x);
        rtcCommitGeometry(geometry_);
        rtcCommitScene(scene_);
    }

    RTCScene scene() const { return scene_; }
    const PosedFaces& faces() const { return faces_; }

 private:
    static void bound_face(const RTCBoundsFunctionArguments* arguments) {
        const PosedFaces& faces = static_cast<const EmbreeScene*>(arguments->geometryUserPtr)->faces_;
        const Box box = bounding_box(faces.triangle(arguments->primID));
        RTCBounds& out = *arguments->bounds_o;
        out.lower_x = box.lo[0];
        out.lower_y = box.lo[1];
        out.lower_z = box.lo[2];
        out.upper_x = box.hi[0];
        out.upper_y = box.hi[1];
        out.upper_z = box.hi[2];
    }

    RTCScene scene_;
    RTCGeometry geometry_;
    PosedFaces faces_;
};

class EmbreePairs final : public PairMethod {
 public:
    explicit EmbreePairs(const BenchBody& body)
        : device_(rtcNewDevice("threads=1,set_affinity=0")),
          a_(device_, body.surface),
          b_(device_, body.surface) {}
    ~EmbreePairs() override { rtcReleaseDevice(device_); }

    void update(const BenchPose& a, const BenchPose& b) override {
        a_.update(a.x);
        b_.update(b.x);
    }
    std::span<const FacePair> query() override {
        candidates_.clear();
        rtcCollide(a_.scene(), b_.scene(), collect, this);
        keep_intersecting(candidates_, a_.faces(), b_.faces());
        std::ranges::sort(candidates_);
        candidates_.erase(std::unique(candidates_.begin(), candidates_.end()), candidates_.end());
        return candidates_;
    }

 private:
    static void collect(void* self, RTCCollision* collisions, unsigned count) {
        auto& candidates = static_cast<EmbreePairs*>(self)->candidates_;
        for (unsigned i = 0; i < count; ++i)
            candidates.push_back(
                {static_cast<int>(collisions[i].primID0), static_cast<int>(collisions[i].primID1)});
    }

    RTCDevice device_;
    EmbreeScene a_, b_;
    std::vector<FacePair> candidates_;
};

}  // namespace

std::vector<PairMethodEntry> embree_methods() {
    return {{.name = "embree",
             .make = [](const BenchBody& body) { return std::make_unique<EmbreePairs>(body); }}};
}

}  // namespace nbd
#else
namespace nbd {

std::vector<PairMethodEntry> embree_methods() { return {}; }

}  // namespace nbd
#endif

#include <CGAL/box_intersection_d.h>

#include "apps/bench/peers/candidates.hpp"
#include "apps/bench/peers/peers.hpp"
#include "collision/geometry/box.hpp"

namespace nbd {
namespace {

using CgalBox = CGAL::Box_intersection_d::Box_d<float, 3, CGAL::Box_intersection_d::ID_EXPLICIT>;

/// One box per face, and handles to those that overlap the other body's box. The algorithm sorts handles, so
/// leaving out other boxes saves time, and handles are cheaper to move than boxes.
class CgalFaces {
 public:
    explicit CgalFaces(const SurfaceBody& body)
        : faces_{&body.F, body.X}, boxes_(static_cast<std::size_t>(body.F.rows())) {}

    void update(const VerticesRef& x) {
        faces_.x = VertexView::as_long_as(x);
        all_ = empty_box();
        for (std::size_t f = 0; f < boxes_.size(); ++f) {
            const Box box = bounding_box(faces_.triangle(static_cast<int>(f)));
            float lo[] = {box.lo[0], box.lo[1], box.lo[2]}, hi[] = {box.hi[0], box.hi[1], box.hi[2]};
            boxes_[f] = CgalBox(lo, hi);
            all_ = joined(all_, box);
        }
    }
    void choose(const Box& other) {
        chosen_.clear();
        for (const CgalBox& box : boxes_) {
            bool overlaps = true;
            for (int axis = 0; axis < 3; ++axis)
                overlaps &= box.min_coord(axis) <= other.hi[axis] && other.lo[axis] <= box.max_coord(axis);
            if (overlaps) chosen_.push_back(&box);
        }
    }
    int face_of(const CgalBox* box) const { return static_cast<int>(box - boxes_.data()); }
    std::vector<const CgalBox*>& chosen() { return chosen_; }
    const Box& all() const { return all_; }
    const PosedFaces& faces() const { return faces_; }

 private:
    PosedFaces faces_;
    std::vector<CgalBox> boxes_;
    std::vector<const CgalBox*> chosen_;
    Box all_ = empty_box();
};

class CgalPairs final : public PairMethod {
 public:
    explicit CgalPairs(const BenchBody& body) : a_(body.surface), b_(body.surface) {}

    void update(const BenchPose& a, const BenchPose& b) override {
        a_.update(a.x);
        b_.update(b.x);
    }
    std::span<const FacePair> query() override {
        candidates_.clear();
        a_.choose(b_.all());
        b_.choose(a_.all());
        CGAL::box_intersection_d(a_.chosen().begin(), a_.chosen().end(), b_.chosen().begin(),
                                 b_.chosen().end(), [this](const CgalBox* s, const CgalBox* t) {
                                     candidates_.push_back({a_.face_of(s), b_.face_of(t)});
                                 });
        return sorted_intersecting(candidates_, a_.faces(), b_.faces());
    }

 private:
    CgalFaces a_, b_;
    std::vector<FacePair> candidates_;
};

}  // namespace

std::unique_ptr<PairMethod> make_cgal_pairs(const BenchBody& body) {
    return std::make_unique<CgalPairs>(body);
}

}  // namespace nbd

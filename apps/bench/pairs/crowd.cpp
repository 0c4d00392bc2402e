#include "apps/bench/pairs/crowd.hpp"

#include <cmath>

#include "apps/bench/pairs/lazy_boxes.hpp"
#include "collision/base/counter_random.hpp"
#include "collision/query/many_body_query.hpp"
#include "collision/query/sweep.hpp"

namespace nbd {
namespace {

class TreeCrowd final : public Crowd {
 public:
    TreeCrowd(const BenchBody& body, BoundKind kind, int count, const Executor& executor)
        : executor_(executor), query_(executor) {
        for (int i = 0; i < count; ++i) trees_.emplace_back(body.tree, kind);
        for (PosedTree& tree : trees_) bodies_.push_back(&tree);
    }
    void update(std::span<const Vertices> poses) override {
        executor_(static_cast<int>(trees_.size()), [&](int i) {
            trees_[static_cast<std::size_t>(i)].begin_pose(poses[static_cast<std::size_t>(i)]);
        });
    }
    long pairs() override {
        long count = 0;
        for (const TouchingBodies& touching : query_.intersecting(bodies_))
            count += static_cast<long>(touching.faces.size());
        return count;
    }

 private:
    Executor executor_;
    std::vector<PosedTree> trees_;
    std::vector<PosedTree*> bodies_;
    ManyBodyQuery query_;
};

class LazyBoxesCrowd final : public Crowd {
 public:
    LazyBoxesCrowd(const BenchBody& body, int cluster_faces, int count)
        : bodies_(static_cast<std::size_t>(count),
                  LazyBoxes(body.surface.X, body.surface.F, {cluster_faces})),
          boxes_(bodies_.size()) {}
    void update(std::span<const Vertices> poses) override {
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            bodies_[i].begin_pose(poses[i]);
            boxes_[i] = bodies_[i].box();
        }
    }
    long pairs() override {
        long count = 0;
        for (const auto& [i, j] : sweep_.touching(boxes_)) {
            intersecting_faces(bodies_[static_cast<std::size_t>(i)], bodies_[static_cast<std::size_t>(j)],
                               found_);
            count += static_cast<long>(found_.size());
        }
        return count;
    }

 private:
    std::vector<LazyBoxes> bodies_;
    std::vector<Box> boxes_;
    Sweep sweep_;
    std::vector<FacePair> found_;
};

}  // namespace

std::unique_ptr<Crowd> make_tree_crowd(const BenchBody& body, BoundKind kind, int count,
                                       const Executor& executor) {
    return std::make_unique<TreeCrowd>(body, kind, count, executor);
}

std::unique_ptr<Crowd> make_lazy_boxes_crowd(const BenchBody& body, int cluster_faces, int count) {
    return std::make_unique<LazyBoxesCrowd>(body, cluster_faces, count);
}

std::vector<Vertices> crowd_poses(const BenchBody& body, const RecordingReader& recording,
                                  std::span<const FrameId> frames, int count, double spacing,
                                  std::uint64_t seed) {
    const int side = static_cast<int>(std::ceil(std::cbrt(count) - 1e-9));
    const float step = static_cast<float>(spacing) * body.tree->spheres.rest[0].r;
    std::vector<Vertices> poses(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        CounterRandom random(seed, static_cast<std::uint64_t>(i));
        const FrameId frame = frames[static_cast<std::size_t>(random.index(static_cast<int>(frames.size())))];
        Vertices nodes, x;
        recording.read(frame.trajectory, frame.frame, 1, nodes);
        apply_embedding(body.surface.W, nodes, x);
        const Eigen::RowVector3f centre = x.colwise().mean();
        const Eigen::Matrix3f turn = random.orientation().toRotationMatrix().cast<float>();
        const Eigen::RowVector3i cell(i % side, i / side % side, i / (side * side));
        poses[static_cast<std::size_t>(i)] =
            ((x.rowwise() - centre) * turn.transpose()).rowwise() + step * cell.cast<float>();
    }
    return poses;
}

}  // namespace nbd

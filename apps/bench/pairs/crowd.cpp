#include "apps/bench/pairs/crowd.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "apps/bench/pairs/lazy_boxes.hpp"
#include "collision/counter_random.hpp"
#include "collision/pair_query.hpp"
#include "collision/separation.hpp"

namespace nbd {
namespace {

class TreeCrowd final : public Crowd {
 public:
    TreeCrowd(const BenchBody& body, BoundKind kind, int count) : boxes_(static_cast<std::size_t>(count)) {
        for (int i = 0; i < count; ++i) trees_.emplace_back(body.tree, kind);
    }
    void update(std::span<const Vertices> poses) override {
        for (std::size_t i = 0; i < trees_.size(); ++i) trees_[i].begin_pose(poses[i]);
    }
    long pairs() override {
        for (std::size_t i = 0; i < trees_.size(); ++i) {
            const Sphere& root = trees_[i].sphere(0);
            const Eigen::Array3f lo = root.c.array() - root.r, hi = root.c.array() + root.r;
            boxes_[i] = trees_[i].box(0).value_or(Box{{lo[0], lo[1], lo[2], 0}, {hi[0], hi[1], hi[2], 0}});
        }
        sweep_boxes(boxes_, order_, near_);
        long count = 0;
        for (const auto& [i, j] : near_)
            count += static_cast<long>(
                query_.intersecting(trees_[static_cast<std::size_t>(i)], trees_[static_cast<std::size_t>(j)])
                    .size());
        return count;
    }

 private:
    std::vector<PosedTree> trees_;
    std::vector<Box> boxes_;
    std::vector<int> order_;
    std::vector<std::pair<int, int>> near_;
    PairQuery query_;
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
        sweep_boxes(boxes_, order_, near_);
        long count = 0;
        for (const auto& [i, j] : near_) {
            intersecting_faces(bodies_[static_cast<std::size_t>(i)], bodies_[static_cast<std::size_t>(j)],
                               found_);
            count += static_cast<long>(found_.size());
        }
        return count;
    }

 private:
    std::vector<LazyBoxes> bodies_;
    std::vector<Box> boxes_;
    std::vector<int> order_;
    std::vector<std::pair<int, int>> near_;
    std::vector<FacePair> found_;
};

}  // namespace

std::unique_ptr<Crowd> make_tree_crowd(const BenchBody& body, BoundKind kind, int count) {
    return std::make_unique<TreeCrowd>(body, kind, count);
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
        const Eigen::RowVector3f place(static_cast<float>(i % side), static_cast<float>(i / side % side),
                                       static_cast<float>(i / (side * side)));
        poses[static_cast<std::size_t>(i)] =
            ((x.rowwise() - centre) * turn.transpose()).rowwise() + step * place;
    }
    return poses;
}

void sweep_boxes(std::span<const Box> boxes, std::vector<int>& order,
                 std::vector<std::pair<int, int>>& pairs) {
    order.resize(boxes.size());
    std::iota(order.begin(), order.end(), 0);
    const auto box = [&](int i) -> const Box& { return boxes[static_cast<std::size_t>(i)]; };
    std::ranges::sort(order, {}, [&](int i) { return std::pair(box(i).lo[0], i); });
    pairs.clear();
    for (auto i = order.begin(); i != order.end(); ++i)
        for (auto j = i + 1; j != order.end() && box(*j).lo[0] <= box(*i).hi[0]; ++j)
            if (!apart(box(*i), box(*j), 0)) pairs.emplace_back(*i, *j);
}

}  // namespace nbd

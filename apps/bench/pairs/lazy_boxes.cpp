#include "apps/bench/pairs/lazy_boxes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#ifdef __AVX__
#include <immintrin.h>
#endif

#include "collision/bounds/walk.hpp"
#include "collision/nbd_tree/sphere_tree.hpp"
#include "collision/query/narrow_phase.hpp"

namespace nbd {
namespace {

constexpr int box_lanes = BoxPack::lanes;

/// Halves [begin, end) until no part has more than `most`; appends the parts in order.
template <class Range>
void cut(int begin, int end, int most, std::vector<Range>& parts) {
    if (end - begin <= most) {
        parts.push_back({begin, end});
        return;
    }
    const int middle = begin + (end - begin) / 2;
    cut(begin, middle, most, parts);
    cut(middle, end, most, parts);
}

bool overlap(const Box& s, const Box& t) noexcept { return (s.lo <= t.hi).all() && (t.lo <= s.hi).all(); }

using Point = Eigen::Map<const Eigen::Array4f>;
using TwoPoints = Eigen::Array<float, 8, 1>;

/// Loads two points into one vector, without Eigen's detour through memory.
TwoPoints two_points(const float* first, const float* second) noexcept {
    TwoPoints points;
#ifdef __AVX__
    const __m256 low = _mm256_castps128_ps256(_mm_loadu_ps(first));
    _mm256_store_ps(points.data(), _mm256_insertf128_ps(low, _mm_loadu_ps(second), 1));
#else
    points << Point(first), Point(second);
#endif
    return points;
}

}  // namespace

void PointBoxes::add(std::span<const int> points) {
    for (const int p : points)
        if (3 * p != last_)
            floats_.push_back(3 * p);
        else
            with_last_.push_back(size());
    ends_.push_back(floats_.size());
}

Box PointBoxes::box(int list, const float* x) const noexcept {
    const std::size_t i = list;
    const int *p = floats_.data() + (i == 0 ? 0 : ends_[i - 1]), *end = floats_.data() + ends_[i];
    // Several independent minima, so that none waits for the one before.
    constexpr int chains = 4;
    constexpr float inf = std::numeric_limits<float>::infinity();
    TwoPoints lo[chains], hi[chains];
    for (int c = 0; c < chains; ++c) {
        lo[c].setConstant(inf);
        hi[c].setConstant(-inf);
    }
    for (; end - p >= 2 * chains; p += 2 * chains)
        for (int c = 0; c < chains; ++c) {
            const TwoPoints points = two_points(x + p[2 * c], x + p[2 * c + 1]);
            lo[c] = lo[c].min(points);
            hi[c] = hi[c].max(points);
        }
    const TwoPoints low = lo[0].min(lo[1]).min(lo[2].min(lo[3]));
    const TwoPoints high = hi[0].max(hi[1]).max(hi[2].max(hi[3]));
    Box box{low.head<4>().min(low.tail<4>()), high.head<4>().max(high.tail<4>())};
    for (; p < end; ++p) {
        box.lo = box.lo.min(Point(x + *p));
        box.hi = box.hi.max(Point(x + *p));
    }
    if (std::ranges::binary_search(with_last_, list)) {
        const Eigen::Array4f point(x[last_], x[last_ + 1], x[last_ + 2], 0);
        box.lo = box.lo.min(point);
        box.hi = box.hi.max(point);
    }
    box.lo[3] = box.hi[3] = 0;
    return box;
}

LazyBoxes::LazyBoxes(VerticesRef X, FacesRef F, int cluster_faces)
    : cluster_points_(X.rows()), block_points_(X.rows()) {
    if (cluster_faces < 1 || cluster_faces > 4096)
        throw std::invalid_argument(fmt::format("clusters of {} faces, allowed: 1 to 4096", cluster_faces));
    // A tree of one leaf lists all faces in an order whose halves, quarters etc. are compact.
    faces_ = build_sphere_tree(X, F, {.depth = 0}).faces;
    corners_ = F(faces_, Eigen::all);
    std::vector<Range> ranges;
    cut(0, F.rows(), cluster_faces, ranges);
    for (const Range& range : ranges) {
        std::vector<Range> blocks;
        cut(range.begin, range.end, std::max(1, (cluster_faces + box_lanes - 1) / box_lanes), blocks);
        clusters_.push_back(
            {static_cast<int>(blocks_.size()), static_cast<int>(blocks_.size() + blocks.size())});
        cluster_points_.add(vertices_of(range));
        for (const Range& block : blocks) {
            const int begin = groups_.size();
            cut(block.begin, block.end, box_lanes, groups_);
            blocks_.push_back({begin, static_cast<int>(groups_.size())});
            block_points_.add(vertices_of(block));
        }
    }
    cluster_boxes_.resize((clusters_.size() + box_lanes - 1) / box_lanes);
    near_.resize(cluster_boxes_.size());
    block_boxes_.resize(clusters_.size());
    face_boxes_.resize(groups_.size());
    cluster_poses_.assign(clusters_.size(), 0);
    block_poses_.assign(blocks_.size(), 0);
}

std::vector<int> LazyBoxes::vertices_of(const Range& slots) const {
    std::vector<int> vertices(corners_.data() + 3 * slots.begin, corners_.data() + 3 * slots.end);
    std::ranges::sort(vertices);
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    return vertices;
}

void LazyBoxes::begin_pose(VertexView x) noexcept {
    x_ = x;
    points_ = x.data();
    ++pose_;
    all_ = empty_box();
    for (std::size_t c = 0; c < clusters_.size(); ++c) {
        const Box box = cluster_points_.box(c, points_);
        cluster_boxes_[c / box_lanes].set(c % box_lanes, box);
        all_ = joined(all_, box);
    }
}

void LazyBoxes::refit_blocks(int cluster) noexcept {
    const std::size_t c = cluster;
    if (cluster_poses_[c] == pose_) return;
    cluster_poses_[c] = pose_;
    const Range blocks = clusters_[c];
    for (int b = blocks.begin; b < blocks.end; ++b)
        block_boxes_[c].set(b - blocks.begin, block_points_.box(b, points_));
}

void LazyBoxes::refit_faces(int block) noexcept {
    const std::size_t b = block;
    if (block_poses_[b] == pose_) return;
    block_poses_[b] = pose_;
    for (int g = blocks_[b].begin; g < blocks_[b].end; ++g) {
        const Range slots = groups_[g];
        for (int slot = slots.begin; slot < slots.end; ++slot)
            face_boxes_[g].set(slot - slots.begin, faces().box(slot));
    }
}

void LazyBoxes::test_blocks(LazyBoxes& a, int block_a, LazyBoxes& b, int block_b, const Box& box_b,
                            std::vector<FacePair>& pairs) {
    a.refit_faces(block_a);
    b.refit_faces(block_b);
    const Range groups_a = a.blocks_[block_a], groups_b = b.blocks_[block_b];
    // Blocks have up to 256 faces, halved into parts of at most 16: at most 16 groups.
    std::uint16_t near_b[box_lanes], near_a[box_lanes];
    const auto test = [&](const LazyBoxes& boxes, const Range& groups, const Box& box, std::uint16_t* near) {
        kernels().near(boxes.face_boxes_.data() + groups.begin, groups.end - groups.begin, numbers(box), 0,
                       near);
    };
    test(a, groups_a, box_b, near_a);
    for (int ga = groups_a.begin; ga < groups_a.end; ++ga) {
        const BoxPack& faces_a = a.face_boxes_[ga];
        for_each_bit(near_a[ga - groups_a.begin], [&](int i) {
            test(b, groups_b, faces_a.box(i), near_b);
            const int slot_a = a.groups_[ga].begin + i;
            for (int gb = groups_b.begin; gb < groups_b.end; ++gb)
                for_each_bit(near_b[gb - groups_b.begin], [&](int j) {
                    const int slot_b = b.groups_[gb].begin + j;
                    pairs.push_back({slot_a, slot_b});
                });
        });
    }
}

void LazyBoxes::test_clusters(LazyBoxes& a, int cluster_a, const Box& box_a, LazyBoxes& b, int cluster_b,
                              const Box& box_b, std::vector<FacePair>& pairs) {
    a.refit_blocks(cluster_a);
    b.refit_blocks(cluster_b);
    const std::size_t ca = cluster_a, cb = cluster_b;
    const BoxPack &blocks_a = a.block_boxes_[ca], &blocks_b = b.block_boxes_[cb];
    const Within touching(0);
    const unsigned touched_b = near_boxes(blocks_b, box_a, touching);
    for_each_bit(near_boxes(blocks_a, box_b, touching), [&](int i) {
        const Box block_box = blocks_a.box(i);
        for_each_bit(touched_b & near_boxes(blocks_b, block_box, touching), [&](int j) {
            test_blocks(a, a.clusters_[ca].begin + i, b, b.clusters_[cb].begin + j, blocks_b.box(j), pairs);
        });
    });
}

void intersecting_faces(LazyBoxes& a, LazyBoxes& b, std::vector<FacePair>& pairs) {
    pairs.clear();
    if (!overlap(a.all_, b.all_)) return;
    const auto find_near = [](LazyBoxes& boxes, const Box& box) {
        kernels().near(boxes.cluster_boxes_.data(), boxes.cluster_boxes_.size(), numbers(box), 0,
                       boxes.near_.data());
    };
    find_near(a, b.all_);
    for (std::size_t wa = 0; wa < a.cluster_boxes_.size(); ++wa)
        for_each_bit(a.near_[wa], [&](int i) {
            const Box box = a.cluster_boxes_[wa].box(i);
            find_near(b, box);
            for (std::size_t wb = 0; wb < b.cluster_boxes_.size(); ++wb)
                for_each_bit(b.near_[wb], [&](int j) {
                    LazyBoxes::test_clusters(a, static_cast<int>(wa) * box_lanes + i, box, b,
                                             static_cast<int>(wb) * box_lanes + j,
                                             b.cluster_boxes_[wb].box(j), pairs);
                });
        });
    keep_intersecting(pairs, a.faces(), b.faces());
    for (FacePair& pair : pairs) pair = {a.faces_[pair.a], b.faces_[pair.b]};
    std::ranges::sort(pairs);
}

}  // namespace nbd

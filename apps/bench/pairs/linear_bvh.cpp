#include "apps/bench/pairs/linear_bvh.hpp"

#include <algorithm>
#include <utility>

#include "collision/kernels/lane_mask.hpp"
#include "collision/query/keep_intersecting.hpp"

namespace nbd {
namespace {

constexpr int bits_per_axis = 10, digit_bits = 10, digits = 3;

bool overlap_in_space(const Box& s, const Box& t) noexcept {
    return ((s.lo <= t.hi) && (t.lo <= s.hi)).head<3>().all();
}

/// Moves bit i of ten bits to bit 3 i.
std::uint32_t spread(std::uint32_t x) noexcept {
    x = (x | x << 16) & 0x030000ff;
    x = (x | x << 8) & 0x0300f00f;
    x = (x | x << 4) & 0x030c30c3;
    return (x | x << 2) & 0x09249249;
}

}  // namespace

void LinearBvh::begin_pose(VertexView x) noexcept {
    x_ = x;
    using Block = Eigen::Array<float, 12, 1>;  // four vertices
    const float *p = x.data(), *end = p + 3 * x.count();
    Eigen::Array3f lo = Eigen::Array3f::Constant(empty_box().lo[0]), hi = -lo;
    Block block_lo = lo.replicate<4, 1>(), block_hi = -block_lo;
    for (; end - p >= Block::SizeAtCompileTime; p += Block::SizeAtCompileTime) {
        block_lo = block_lo.min(Eigen::Map<const Block>(p));
        block_hi = block_hi.max(Eigen::Map<const Block>(p));
    }
    for (; p < end; p += 3) {
        lo = lo.min(Eigen::Map<const Eigen::Array3f>(p));
        hi = hi.max(Eigen::Map<const Eigen::Array3f>(p));
    }
    for (int k = 0; k < 4; ++k) {
        lo = lo.min(block_lo.segment<3>(3 * k));
        hi = hi.max(block_hi.segment<3>(3 * k));
    }
    whole_ = {{lo[0], lo[1], lo[2], 0}, {hi[0], hi[1], hi[2], 0}};
}

void LinearBvh::build(const Box& region) {
    list_faces(region);
    sort_faces();
    height_ = 0;
    const std::size_t count = faces_.size();
    if (count == 0) return;
    boxes_in_[0] = static_cast<int>(count);
    levels_[0].assign((count + lanes - 1) / lanes, {});
    for (std::size_t i = 0; i < count; ++i) {
        const auto listed = static_cast<std::uint32_t>(sorted_[i]);
        levels_[0][i / lanes].set(static_cast<int>(i % lanes), boxes_[listed]);
    }
    for (height_ = 1; levels_[static_cast<std::size_t>(height_ - 1)].size() > 1; ++height_)
        add_level(height_ - 1);
}

void LinearBvh::list_faces(const Box& region) {
    boxes_.clear();
    listed_.clear();
    const PosedFaces posed = faces();
    for (int f = 0; f < corners_.rows(); ++f) {
        const Box box = posed.box(f);
        if (!overlap_in_space(box, region)) continue;
        boxes_.push_back(box);
        listed_.push_back(f);
    }
}

void LinearBvh::sort_faces() {
    const std::size_t count = boxes_.size();
    keys_.resize(count);
    sorted_.resize(count);
    const Eigen::Array4f extent = (whole_.hi - whole_.lo).max(1e-30f);
    const Eigen::Array4f scale = static_cast<float>((1 << bits_per_axis) - 1) / 2 / extent;
    for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Array4i cell =
            ((boxes_[i].lo + boxes_[i].hi - 2 * whole_.lo) * scale).max(0).min(1023).cast<int>();
        const auto code = [&](int axis) { return spread(static_cast<std::uint32_t>(cell[axis])); };
        keys_[i] = Key{code(0) << 2 | code(1) << 1 | code(2)} << 32 | i;
    }
    for (int digit = 0; digit < digits; ++digit) {
        const int shift = 32 + digit * digit_bits;
        std::array<std::uint32_t, 1 << digit_bits> begin{};
        const auto at = [&](Key key) -> std::uint32_t& { return begin[key >> shift & (begin.size() - 1)]; };
        for (const Key key : keys_) ++at(key);
        std::uint32_t sum = 0;
        for (std::uint32_t& n : begin) sum += std::exchange(n, sum);
        for (const Key key : keys_) sorted_[at(key)++] = key;
        std::swap(keys_, sorted_);
    }
    std::swap(keys_, sorted_);
    faces_.resize(count);
    for (std::size_t i = 0; i < count; ++i) faces_[i] = listed_[static_cast<std::uint32_t>(sorted_[i])];
}

void LinearBvh::add_level(int below) {
    const AlignedVector<BoxPack>& packs = levels_[static_cast<std::size_t>(below)];
    AlignedVector<BoxPack>& level = levels_[static_cast<std::size_t>(below) + 1];
    boxes_in_[static_cast<std::size_t>(below) + 1] = static_cast<int>(packs.size());
    level.assign((packs.size() + lanes - 1) / lanes, {});
    for (std::size_t i = 0; i < packs.size(); ++i) {
        Box box = empty_box();
        for (int axis = 0; axis < 3; ++axis) {
            box.lo[axis] = *std::ranges::min_element(packs[i].lo[axis]);
            box.hi[axis] = *std::ranges::max_element(packs[i].hi[axis]);
        }
        level[i / lanes].set(static_cast<int>(i % lanes), box);
    }
}

unsigned LinearBvh::present(int level, int node) const noexcept {
    const int left = boxes_in_[static_cast<std::size_t>(level)] - lanes * node;
    return left >= lanes ? 0xffffu : (1u << left) - 1;
}

void LinearBvh::walk(const LinearBvh& a, int level_a, int node_a, const Box& box_a, const LinearBvh& b,
                     int level_b, int node_b, const Box& box_b, std::vector<FacePair>& pairs) {
    const BoxPack &boxes_a = a.levels_[static_cast<std::size_t>(level_a)][static_cast<std::size_t>(node_a)],
                  &boxes_b = b.levels_[static_cast<std::size_t>(level_b)][static_cast<std::size_t>(node_b)];
    const unsigned in_a = a.present(level_a, node_a), in_b = b.present(level_b, node_b);
    if (level_a > level_b)  // the taller one goes down alone
        return for_each_bit(overlapping(boxes_a, box_b) & in_a, [&](int i) {
            walk(a, level_a - 1, lanes * node_a + i, boxes_a.box(i), b, level_b, node_b, box_b, pairs);
        });
    if (level_a < level_b)
        return for_each_bit(overlapping(boxes_b, box_a) & in_b, [&](int j) {
            walk(a, level_a, node_a, box_a, b, level_b - 1, lanes * node_b + j, boxes_b.box(j), pairs);
        });
    std::uint16_t masks[lanes];
    const unsigned near_a =
        kernels().overlapping_pairs(boxes_a, in_a, numbers(box_a), boxes_b, in_b, numbers(box_b), masks);
    for_each_bit(near_a, [&](int i) {
        for_each_bit(masks[i], [&](int j) {
            if (level_a == 0)
                pairs.push_back({lanes * node_a + i, lanes * node_b + j});
            else
                walk(a, level_a - 1, lanes * node_a + i, boxes_a.box(i), b, level_b - 1, lanes * node_b + j,
                     boxes_b.box(j), pairs);
        });
    });
}

void intersecting_faces(const LinearBvh& a, const LinearBvh& b, std::vector<FacePair>& pairs) {
    pairs.clear();
    if (a.height_ == 0 || b.height_ == 0) return;
    LinearBvh::walk(a, a.height_ - 1, 0, a.whole_, b, b.height_ - 1, 0, b.whole_, pairs);
    for (FacePair& pair : pairs)
        pair = {a.faces_[static_cast<std::size_t>(pair.a)], b.faces_[static_cast<std::size_t>(pair.b)]};
    keep_intersecting(pairs, a.faces(), b.faces());
    std::ranges::sort(pairs);
}

}  // namespace nbd

#pragma once

namespace nbd {

struct Box;

/// Number of values that the kernels process at a time.
inline constexpr int kernel_lanes = 16;

/// Up to sixteen boxes, one per lane, to compare one box with all of them at once. Unused lanes hold the
/// empty box, which is far from every box, or anything if a kernel wrote the pack. box_pack.hpp defines the
/// functions.
struct alignas(64) BoxPack {
    static constexpr int lanes = kernel_lanes;
    float lo[3][lanes], hi[3][lanes];  // [axis][box]

    inline BoxPack() noexcept;
    inline void set(int lane, const Box& box) noexcept;
    inline Box box(int lane) const noexcept;
    /// Makes every box hold that of the same lane as well.
    inline void join(const BoxPack& other) noexcept;
    /// Moves every side outward by `by` metres.
    inline void grow(float by) noexcept;
};

/// Sixteen boxes in a part's rest frame, one per lane: centres and the three vectors from the centre to the
/// middle of a side, of which the last is the shortest. Unused lanes hold zeros.
struct alignas(64) RestBoxes {
    float centre[3][kernel_lanes], side[3][3][kernel_lanes];  // [axis][box], [side][axis][box]
};

/// Sixteen boxes in a pose, one per lane, that an affine map may have sheared: centre, sides as above, and
/// the margin by which they reach farther along each axis.
struct alignas(64) OrientedBoxes {
    float centre[3][kernel_lanes], side[3][3][kernel_lanes], margin[3][kernel_lanes];
    /// A vector across the two long sides of each box, and the slab that holds the box: lo <= normal . x <=
    /// hi. Its length is 1, less where the sides are next to nothing, and NaN where numbers overflow.
    float normal[3][kernel_lanes], lo[kernel_lanes], hi[kernel_lanes];
};

/// Sixteen triangles, one per lane.
struct alignas(64) TrianglePack {
    static constexpr int lanes = kernel_lanes;
    float corners[3][3][lanes];  // [corner][axis][triangle]
};

}  // namespace nbd

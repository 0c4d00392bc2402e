#pragma once

namespace nbd {

struct Box;

/// Numbers that the kernels take at a time.
inline constexpr int kernel_lanes = 16;

/// Up to sixteen boxes, a lane each, so that one box is compared with all of them at once. Lanes without a
/// box hold an empty one: far from every box. Functions: box_pack.hpp.
struct alignas(64) BoxPack {
    static constexpr int lanes = kernel_lanes;
    float lo[3][lanes], hi[3][lanes];  // [axis][box]

    inline BoxPack() noexcept;
    inline void set(int lane, const Box& box) noexcept;
    inline Box box(int lane) const noexcept;
    /// Moves every side outward, metres.
    inline void grow(float by) noexcept;
};

/// Sixteen triangles, a lane each.
struct alignas(64) TrianglePack {
    static constexpr int lanes = kernel_lanes;
    float corners[3][3][lanes];  // [corner][axis][triangle]
};

}  // namespace nbd

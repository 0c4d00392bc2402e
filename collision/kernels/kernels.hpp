#pragma once

#include <cstdint>

namespace nbd {

struct BoxPack;
struct TrianglePack;

/// Instruction sets that the kernels have a form for: what the library is compiled for, AVX2, and AVX-512
/// with its extensions F, BW, DQ, VL and VNNI.
enum class InstructionSet { plain, avx2, avx512 };

/// What is certain, in exact arithmetic, of the triangles in each lane of two packs. A lane that is in
/// neither is too close to call in float32.
struct PackVerdict {
    unsigned meeting = 0, apart = 0;  // bit k: s[k] and t[k] have a point in common, or none
    bool operator==(const PackVerdict&) const = default;
};

/// One layer of a small network: 4 * quads inputs, its outputs in groups of 16. Output o is
/// scales[o] * sum over i of weights[at(o, i)] * x(i) + biases[o], with ReLU no less than 0.
struct ByteLayer {
    const std::int8_t* weights;  // -127 to 127
    const std::int32_t* sums;    // [outputs] of their weights
    const float *scales, *biases;
    int quads, outputs;
    bool relu;

    /// Four inputs of an output lie together, the second pair in between the first.
    int at(int output, int input) const noexcept {
        return (input / 4 * outputs + output) * 4 + input % 2 * 2 + input / 2 % 2;
    }
};

/// Columns of a matrix in fixed point: number r of column c is values[c * rows + r] * scales[c].
struct FixedColumns {
    const std::int16_t* values;  // -16383 to 16383
    const float* scales;
    int rows, count;  // rows: a multiple of 32
};

/// The inner loops of a query, each in one form for an instruction set. All forms give the same bits, but for
/// which number that is none: sums of integers are exact, and those of floats run in one order, without fused
/// products. Nothing here allocates.
struct Kernels {
    /// Largest magnitude of a vector in fixed point.
    static constexpr int max_fixed = 16384;
    /// Networks at a time: one waits while another one computes.
    static constexpr int max_networks = 2;
    /// Inputs of a network, of more of which sums might overflow, outputs of a layer in between, and of a
    /// network, zeros added.
    static constexpr int max_inputs = 1024, max_hidden = 128, outputs = 16;

    InstructionSet instructions;

    /// masks[p], bit k: unless box k of packs[p] and `box`, 4 numbers each of its low and high corner, have
    /// no point in common.
    void (*overlapping)(const BoxPack* packs, int count, const float* box, std::uint16_t* masks) noexcept;
    /// Likewise unless their squared gap is more than `most`; but for a few ulp, which certain_square()
    /// covers.
    void (*near)(const BoxPack* packs, int count, const float* box, float most,
                 std::uint16_t* masks) noexcept;
    /// Both for some boxes of a node with those of another one, which lie in up to two packs each: bit k of
    /// masks[i], for each bit i that is set in `which`, is that of boxes[i / 16], lane i % 16, and
    /// packs[k / 16], lane k % 16.
    void (*overlapping_each)(const BoxPack* packs, int count, const BoxPack* boxes, unsigned which,
                             unsigned* masks) noexcept;
    void (*near_each)(const BoxPack* packs, int count, const BoxPack* boxes, unsigned which, float most,
                      unsigned* masks) noexcept;
    /// See triangle_pack.hpp.
    unsigned (*separated_by_plane)(const TrianglePack& s, const TrianglePack& t) noexcept;
    PackVerdict (*edges_meet_faces)(const TrianglePack& s, const TrianglePack& t) noexcept;

    /// x, `count` numbers, a multiple of 16, as fixed[i] * scale, rounded to the nearest. Returns the scale,
    /// a power of 2 that takes the largest one to at least max_fixed / 2, or 0 where all are below 2^-100;
    /// not a number, and all of fixed 0, where any of x is not finite.
    float (*fix)(const float* x, int count, std::int16_t* fixed) noexcept;
    /// products[c] = the sum of column c's numbers times those of x * scale, x as fix() gives it. Not a
    /// number where the scale is none.
    void (*products)(const FixedColumns& columns, const std::int16_t* x, float scale,
                     float* products) noexcept;
    /// What some networks of one shape, of three layers each, the first two with ReLU, make of the same
    /// x * scale. What these two give goes on rounded to 8 bits. count: networks, at most max_networks.
    /// Besides the products of some columns, for which there is time while networks wait.
    void (*networks)(const ByteLayer (*layers)[3], int count, const FixedColumns& columns,
                     const std::int16_t* x, float scale, float (*results)[outputs], float* products) noexcept;
};

/// The form for an instruction set; null where this machine or this build of the library has it not.
const Kernels* kernels_for(InstructionSet instructions) noexcept;

/// What all queries use: the form that suits this machine best, or the one that use_kernels() was given last.
const Kernels& kernels() noexcept;

/// For comparisons, before any query runs: answers are the same.
void use_kernels(const Kernels& form) noexcept;

/// "plain", "avx2" or "avx512".
const char* name(InstructionSet instructions) noexcept;

}  // namespace nbd

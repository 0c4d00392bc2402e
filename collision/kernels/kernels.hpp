#pragma once

#include <cstdint>

namespace nbd {

struct BoxPack;
struct OrientedBoxes;
struct RestBoxes;
struct TrianglePack;

/// Instruction sets with their own form of the kernels: the library's own (`plain`), AVX2, AVX-512 with
/// its extensions F, BW, DQ, VL and VNNI, and NEON of 64-bit Arm.
enum class InstructionSet { plain, avx2, avx512, neon };

/// All of them, slower ones first.
inline constexpr InstructionSet instruction_sets[] = {InstructionSet::plain, InstructionSet::avx2,
                                                      InstructionSet::avx512, InstructionSet::neon};

/// What is certain, in exact arithmetic, about the triangles in each lane of two packs. A lane that is set in
/// neither mask is too close to call in float32.
struct PackVerdict {
    unsigned meeting = 0, apart = 0;  // bit k: s[k] and t[k] have a point in common; have none
    bool operator==(const PackVerdict&) const = default;
};

/// One layer of a small network with 4 * quads inputs; the number of outputs is a multiple of 16. Output o is
/// scales[o] * sum over i of weights[at(o, i)] * x(i) + biases[o], and at least 0 with ReLU.
struct ByteLayer {
    const std::int8_t* weights;  // -127 to 127
    const std::int32_t* sums;    // [outputs] sum of each output's weights
    const float *scales, *biases;
    int quads, outputs;
    bool relu;

    /// Index of a weight. Four inputs of an output lie together, in the order 0, 2, 1, 3.
    int at(int output, int input) const noexcept {
        return (input / 4 * outputs + output) * 4 + input % 2 * 2 + input / 2 % 2;
    }
};

/// Columns of a matrix in fixed point: entry r of column c is values[c * rows + r] * scales[c].
struct FixedColumns {
    const std::int16_t* values;  // -16383 to 16383
    const float* scales;
    int rows, count;  // rows: a multiple of 32
};

/// Nodes that carry a part of a surface, x = W nodes with weights >= 0, and the sixteen children of the part.
/// `rest` are coordinates in the rest pose, in a frame and a unit of length of their own: integers, so that
/// they are exact.
struct AffinePart {
    const std::int32_t* nodes;  // [count] place of each node's first coordinate in the array of all nodes
    int count;                  // a multiple of 16; some nodes may be listed more than once
    bool at_end;                // the last node of all is among them: no number may follow it in memory
    /// [16 * carriers] places in `nodes` of the nodes that carry each child: those of child k at k, k + 16
    /// and so on, some more than once.
    const std::uint16_t* carrier;
    int carriers;
    const std::int16_t* rest;  // [3 * count] all x, then all y, then all z
    const float* moments;      // xx, xy, xz, yy, yz, zz of the (pseudo-)inverse of the sum of rest rest^T
    const float* reach;  // [3] largest magnitude of a coordinate of the nodes, and of a centre plus sides
};

/// The inner loops of queries for one instruction set. All forms give identical bits, except NaN payloads:
/// integer sums are exact, and float sums run in a fixed order without fused products. Nothing here
/// allocates.
struct Kernels {
    /// Largest magnitude of a number in fixed point.
    static constexpr int max_fixed = 16384;
    /// Networks evaluated at a time: one computes while the other waits.
    static constexpr int max_networks = 2;
    /// Maximum number of inputs of a network (more could overflow the sums), maximum number of outputs of a
    /// hidden layer, and number of outputs of a network, padding included.
    static constexpr int max_inputs = 1024, max_hidden = 128, outputs = 16;

    InstructionSet instructions;

    /// Sets bit k of masks[p] unless the squared gap between box k of packs[p] and `box` exceeds `most`;
    /// exact up to a few ulp, which certain_square() covers. For `most` 0, sets it unless the boxes have no
    /// point in common, exactly. box: 4 numbers of the low corner, then 4 of the high corner.
    void (*near)(const BoxPack* packs, int count, const float* box, float most,
                 std::uint16_t* masks) noexcept;
    /// The same test for some boxes of one node against those of another, in up to two packs each.
    /// For each bit i set in `which`, bit k of masks[i] is the result for boxes[i / 16], lane i % 16, and
    /// packs[k / 16], lane k % 16.
    void (*near_each)(const BoxPack* packs, int count, const BoxPack* boxes, unsigned which, float most,
                      unsigned* masks) noexcept;
    /// The same test for the boxes of two packs. Returns the lanes of s that are near whole_t, or none
    /// if no lane of t is near whole_s; for each of them sets bit k of masks[i] if box i of s and box k of t
    /// are near, and box k is near whole_s. in_s, in_t: lanes to be looked at. whole_s, whole_t: boxes that
    /// hold what these lanes bound.
    unsigned (*near_pairs)(const BoxPack& s, unsigned in_s, const float* whole_s, const BoxPack& t,
                           unsigned in_t, const float* whole_t, float most, std::uint16_t* masks) noexcept;
    /// The box around points x + places[k], k < count, which may be 0: the empty box. Reads a fourth number
    /// of each, which does not count. Returns whether all numbers are finite; if not, the box means nothing.
    /// box: eight numbers as above.
    bool (*box_of_points)(const float* x, const std::int32_t* places, int count, float* box) noexcept;
    /// Likewise boxes around several lists of points, which lie one after the other in `places`. counts:
    /// [lists] of points, multiples of four. boxes: [lists] eight numbers each.
    bool (*boxes_of_lists)(const float* x, const std::int32_t* places, const std::int32_t* counts, int lists,
                           float* boxes) noexcept;
    /// Likewise the boxes around sixteen lists. Box k is around the points places[k], places[k + 16] and so
    /// on, `count` in number, at least 1. at_end: the last point of all is among them, and no number may
    /// follow it in memory.
    bool (*boxes_of_points)(const float* x, const std::int32_t* places, int count, bool at_end,
                            BoxPack& boxes) noexcept;
    /// The box around the first `count` boxes of a pack, 1 to 16. box: eight numbers as above.
    void (*hull)(const BoxPack& boxes, int count, float* box) noexcept;
    /// For each bit i set in `which`, clears bit k of masks[i] where box i of s and box k of t are certainly
    /// more than `distance` apart across the slab that holds one of them.
    void (*clear_parted)(const OrientedBoxes& s, const OrientedBoxes& t, float distance, unsigned which,
                         std::uint16_t* masks) noexcept;
    /// Boxes of sixteen triangles, exact. points: four numbers each, of which the first three count. corners:
    /// corner c of triangle k is the point corners[16 * c + k].
    void (*triangle_boxes)(const float* points, const std::uint8_t* corners, BoxPack& boxes) noexcept;
    /// Packs sixteen triangles. corners: [3][16], where each corner stands; reads a fourth number of each,
    /// which does not count.
    void (*pack_triangles)(const float* const (*corners)[16], TrianglePack& pack) noexcept;
    /// Sets bit k if the plane of one of the triangles s[k] and t[k] certainly has the other strictly on one
    /// side; they then have no point in common.
    unsigned (*separated_by_plane)(const TrianglePack& s, const TrianglePack& t) noexcept;
    /// Whether an edge of one triangle meets the other triangle. If two triangles have a point in common,
    /// some edge does.
    PackVerdict (*edges_meet_faces)(const TrianglePack& s, const TrianglePack& t) noexcept;

    /// Boxes around the children of a part in a pose, from its nodes alone. `rest`: boxes in the frame of
    /// `part.rest` around X = W rest of the children's vertices. rounding: see AffineModel::rounding.
    /// scratch: 3 * count floats. The kernel fits an affine map (A, b) to nodes n_i by least squares. What it
    /// leaves, d_i = n_i - A r_i - b, moves a vertex by a convex mean of d_i: x = A X + b + sum w_i d_i. So
    /// the box of a child moves with the map and grows by the box of its carriers' d_i. oriented: the same
    /// bounds before they become boxes along the axes; null: not wanted.
    void (*affine_map)(const AffinePart& part, const RestBoxes& rest, const float* nodes, float rounding,
                       float* scratch, BoxPack& boxes, OrientedBoxes* oriented) noexcept;

    /// Rounds `count` numbers x, a multiple of 16, to the nearest fixed[i] * scale. Returns the scale: a
    /// power of 2 for which the largest magnitude in `fixed` is at least max_fixed / 2; 0 if all numbers are
    /// below 2^-100; NaN if any number is not finite. In the last two cases all of `fixed` is 0.
    float (*fix)(const float* x, int count, std::int16_t* fixed) noexcept;
    /// products[c] = dot product of column c and x * scale, with x from fix(). NaN if the scale is NaN.
    void (*products)(const FixedColumns& columns, const std::int16_t* x, float scale,
                     float* products) noexcept;
    /// Evaluates `count` networks of one shape, at most max_networks, on the same input x * scale. Each has
    /// three layers, the first two with ReLU and with outputs rounded to 8 bits. Also computes the products
    /// of some columns, in the time that the networks would wait.
    void (*networks)(const ByteLayer (*layers)[3], int count, const FixedColumns& columns,
                     const std::int16_t* x, float scale, float (*results)[outputs], float* products) noexcept;
};

/// The forms of this build; not every one has all of them.
extern const Kernels kernels_plain, kernels_avx2, kernels_avx512, kernels_neon;

/// The form for an instruction set; null if the CPU or this build of the library does not support it.
const Kernels* kernels_for(InstructionSet instructions) noexcept;

/// The form that all queries use: the best for this CPU, or the last one passed to use_kernels().
const Kernels& kernels() noexcept;

/// Selects a form, for comparisons. Call it before any query runs. All forms give the same answers.
void use_kernels(const Kernels& form) noexcept;

/// "plain", "avx2", "avx512" or "neon".
const char* name(InstructionSet instructions) noexcept;

}  // namespace nbd

// The kernels, written in terms of lanes. Each kernels_*.cpp compiles them for its instruction set.

constexpr float infinity = __builtin_inff();

#include "collision/kernels/boxes.inl"
#include "collision/kernels/networks.inl"
#include "collision/kernels/oriented.inl"
#include "collision/kernels/points.inl"
#include "collision/kernels/triangles.inl"
// Affine maps make oriented boxes, so they come second.
#include "collision/kernels/affine.inl"

constexpr Kernels make_kernels(InstructionSet instructions) noexcept {
    return {.instructions = instructions,
            .near = near,
            .near_each = near_each,
            .near_pairs = near_pairs,
            .box_of_points = box_of_points,
            .boxes_of_lists = boxes_of_lists,
            .boxes_of_points = boxes_of_points,
            .hull = hull,
            .clear_parted = clear_parted,
            .triangle_boxes = triangle_boxes,
            .pack_triangles = pack_triangles,
            .separated_by_plane = separated_by_plane,
            .edges_meet_faces = edges_meet_faces,
            .affine_map = affine_map,
            .fix = fix,
            .products = products,
            .networks = networks};
}

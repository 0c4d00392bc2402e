#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Arrays that the frames of a trajectory may have besides positions.
enum class FrameField { contact_forces, first_piola_stress, deformation_gradients };

/// Their names in files. of_tets: a 3 x 3 matrix for each tetrahedron; else a vector for each node.
struct FrameFieldName {
    FrameField field;
    const char* name;
    bool of_tets;
};
inline constexpr std::array<FrameFieldName, 3> frame_fields{
    {{FrameField::contact_forces, "contact_forces", false},
     {FrameField::first_piola_stress, "first_piola_stress", true},
     {FrameField::deformation_gradients, "deformation_gradients", true}}};

/// A value for each field.
template <class T>
struct PerField {
    std::array<T, frame_fields.size()> values{};
    T& operator[](FrameField field) noexcept { return values[static_cast<std::size_t>(field)]; }
    const T& operator[](FrameField field) const noexcept { return values[static_cast<std::size_t>(field)]; }
    bool operator==(const PerField&) const = default;
};

/// A face that touches something in a frame.
struct ContactEdge {
    int face = 0;     // of the trajectory's surface
    int partner = 0;  // id of the trajectory that it touches, its own for itself; see the constants below
    int other = -1;   // face of the partner's surface; -1: the partner is an obstacle
    auto operator<=>(const ContactEdge&) const = default;
};
inline constexpr int unrecorded_partner = -1;  // a body without a trajectory in the file
/// Partner number of the obstacle with this index.
constexpr int obstacle_partner(int obstacle) noexcept { return -2 - obstacle; }

/// Largest distance of what touches, metres: of different bodies and obstacles, and of a body with itself.
struct ContactDistances {
    double bodies = 0, self = 0;
    bool operator==(const ContactDistances&) const = default;
};

/// What the frames of a trajectory have besides positions.
struct FrameContents {
    int tets = 0;  // number of tetrahedra; only for fields of these
    PerField<bool> fields{};
    std::optional<ContactDistances> contact_edges{};  // if the frames have such edges
    bool operator==(const FrameContents&) const = default;
};

/// What one frame has besides positions, as its trajectory's FrameContents say; else empty.
struct FrameExtras {
    PerField<Vertices> fields{};               // [nodes, 3], or [3 tets, 3]: three rows a tetrahedron
    std::vector<ContactEdge> contact_edges{};  // sorted, each once; pairs within the body once, face < other
};

/// What is wrong with the edges of a frame, and what was allowed; "" if nothing is. id: of the trajectory.
std::string edge_defect(std::span<const ContactEdge> edges, int id);

}  // namespace nbd

#pragma once

#include <compare>
#include <cstdint>

namespace nbd {

enum class FeatureKind : std::uint8_t { vertex_face, edge_edge };

/// Two features of surfaces that must not meet: a vertex of one surface and a face of the other, or an edge
/// of each. Both may be of one surface; they have no vertex in common then.
struct FeaturePair {
    FeatureKind kind = FeatureKind::vertex_face;
    int surface_a = 0, surface_b = 0;
    int a = 0, b = 0;  // vertex and face, or the edges
    auto operator<=>(const FeaturePair&) const = default;
};

/// A pair of features that may come near during a motion, and the distance at which it begins to press,
/// metres.
struct NearFeatures {
    FeaturePair pair;
    double reach = 0;
    auto operator<=>(const NearFeatures&) const = default;
};

}  // namespace nbd

#include "sim/contact/contact_sides.hpp"

#include <algorithm>

namespace nbd {

double deepest(const VertexSides& sides) noexcept {
    double deepest = 0;
    for (const VertexSide& side : sides) deepest = std::max(deepest, side.depth);
    return deepest;
}

void append(const VertexSides& sides, int body, int other, ContactSides& all) {
    for (const VertexSide& side : sides) {
        all.vertices.push_back({body, other, side.vertex});
        all.normals.push_back(side.normal);
        all.depths.push_back(side.depth);
    }
}

VertexSides sides_of(const ContactSides& all, int body, int other) {
    VertexSides sides;
    for (std::size_t i = 0; i < all.vertices.size(); ++i)
        if (all.vertices[i][0] == body && all.vertices[i][1] == other)
            sides.push_back({all.vertices[i][2], all.normals[i], all.depths[i]});
    std::ranges::sort(sides, {}, &VertexSide::vertex);
    return sides;
}

}  // namespace nbd

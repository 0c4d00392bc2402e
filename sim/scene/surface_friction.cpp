// Parts of a body's surface with a friction of their own.
#include <fmt/format.h>

#include <stdexcept>

#include "sim/scene/build_world.hpp"
#include "sim/scene/read_parts.hpp"

namespace nbd {

SceneFriction read_surface_friction(JsonObject& from) {
    SceneFriction friction{.key = key_of(from), .region = {}, .coefficient = 0};
    if (from.has("region")) friction.region = read_region(from.object("region"));
    if (from.need("coefficient"))
        friction.coefficient = from.optional_number("coefficient", {0, 10, "between 0 and 10"}).value_or(0);
    from.finish();
    return friction;
}

std::vector<double> surface_friction(const SceneBody& spec, const PlacedBody& placed) {
    std::vector<double> of_vertices;
    constexpr double usual = -1;
    if (!spec.friction.empty()) of_vertices.assign(placed.body.surface.X.rows(), usual);
    for (const SceneFriction& part : spec.friction) {
        if (!part.region) {
            of_vertices.assign(of_vertices.size(), part.coefficient);
            continue;
        }
        const std::vector<int> inside =
            parts_in(part.key + ".region", *part.region, BodyPart::vertex, placed);
        if (inside.empty())
            throw std::invalid_argument(
                fmt::format("{}.region: holds no vertex of the body's surface", part.key));
        for (const int vertex : inside) of_vertices[vertex] = part.coefficient;
    }
    return of_vertices;
}

}  // namespace nbd

#include "sim/world/hang_on_body.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "collision/base/notice.hpp"

namespace nbd {

void hang_on_body(CollisionTree& tree, const Body& body, std::string_view name) try {
    hang_on_nodes(tree, body.float_weights(), body.tets.X.cast<float>());
} catch (const std::invalid_argument& error) {
    notice(fmt::format("{}: bounds \"auto\" are boxes, as affine ones are not possible: {}", name,
                       error.what()));
}

}  // namespace nbd

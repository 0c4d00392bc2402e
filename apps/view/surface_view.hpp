#pragma once

#include <string>
#include <vector>

#include "apps/view/posed_body.hpp"
#include "apps/view/view_scene.hpp"

namespace nbd {

/// A surface in a pose.
struct ShownSurface {
    std::string name;
    BodyTree tree;    // without W
    Vertices x;       // [n, 3]
    Vertices rest{};  // [n, 3] that displacement is measured from; empty: none is shown
};

/// Shows surfaces in one pose. distance: of faces that are marked as near, metres; 0: only intersecting ones
/// are marked.
ViewScene view_of_surfaces(const std::vector<ShownSurface>& surfaces, const std::string& title,
                           double distance);

}  // namespace nbd

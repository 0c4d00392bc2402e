#include "apps/view/surface_view.hpp"

#include "apps/view/make_view.hpp"

namespace nbd {

ViewScene view_of_surfaces(const std::vector<ShownSurface>& surfaces, const std::string& title,
                           double distance) {
    ViewScene scene;
    scene.title = title;
    scene.displacement_from = "rest";
    scene.times = {0};
    scene.numbers = {0};
    scene.recorded_frames = 1;
    ViewSources sources;
    for (const ShownSurface& surface : surfaces) {
        ViewSource& source = sources.bodies.emplace_back();
        source.name = surface.name;
        source.tree = surface.tree;
        source.start = surface.rest;
    }
    sources.contact_distance = distance;
    sources.read_nodes = [&](int body, int, Vertices& x) { x = surfaces[body].x; };
    make_view(sources, scene);
    return scene;
}

}  // namespace nbd

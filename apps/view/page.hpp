#pragma once

#include <optional>
#include <ostream>
#include <string>

#include "apps/view/view_scene.hpp"

namespace nbd {

/// What the page of a run that goes on knows of it.
struct LivePage {
    std::string run;     // names the run in what the page asks for
    int frames = 0;      // that the page will show at the end of the run
    double seconds = 0;  // that will be simulated
};

/// Writes a page of HTML that shows the scene in a browser. It contains all that it needs and fetches
/// nothing, except that with `live` it asks the address that it is from for more frames, see page/live.js.
/// Positions are rounded to steps of 1/65535 of the box around all frames of their body. The same scene
/// gives the same bytes. Throws std::invalid_argument on a number that is not finite.
void write_page(std::ostream& out, const ViewScene& scene, const std::optional<LivePage>& live = {});

/// What the frames of a scene add to a page that shows earlier ones, as JSON. Positions are rounded to steps
/// of the box around these frames. Throws like write_page().
std::string frames_text(const ViewScene& scene);

}  // namespace nbd

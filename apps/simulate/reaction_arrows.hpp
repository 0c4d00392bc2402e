#pragma once

#include <span>

#include "apps/drawing/picture.hpp"
#include "apps/view/view_scene.hpp"

namespace nbd {

/// Draws reactions as arrows over pictures of one camera: forces red, torques violet with two heads. All have
/// one scale, which a legend tells.
class ArrowScale {
 public:
    /// all: reactions of all pictures. height: of a picture, pixels.
    ArrowScale(std::span<const ViewReaction> all, const Camera& camera, int height);

    void draw_on(Image& image, std::span<const ViewReaction> reactions, const Camera& camera) const;
    /// Appends a strip with the scale below a picture, unless there is nothing to be shown.
    void add_legend(Image& image) const;

 private:
    float pixels_per_metre_;
    float reach_;                   // metres, of an arrow at the end of the scale
    float force_ = 0, torque_ = 0;  // ends of the scales, N and N m; 0: there are none
};

}  // namespace nbd

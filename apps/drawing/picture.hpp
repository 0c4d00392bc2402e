#pragma once

#include <vector>

#include "apps/drawing/image.hpp"
#include "collision/geometry/geometry.hpp"

namespace nbd {

/// A camera without perspective that looks along `forward`.
struct Camera {
    Eigen::Vector3f target{0, 0, 0};  // in the middle of the picture
    Eigen::Vector3f forward{0, 1, 0}, up{0, 0, 1};
    float extent = 2;  // metres that fit the height

    /// Where a point stands: metres to the right, up and forward of the target.
    Eigen::Vector3f seen(const Eigen::Vector3f& p) const;
};

/// One surface of a picture.
struct PictureSurface {
    Vertices x;
    Faces F;
    Eigen::Vector3f colour;  // 0 to 1
};

/// A floor below the surfaces; it fades away around them. Not seen from behind.
struct PictureFloor {
    Eigen::Vector3f point, normal;  // unit
    float grid = 0.1f;              // metres between its lines
};

/// Draws surfaces and floors with smooth shading, creases kept, and the shadows of one light. No display
/// needed. Nine samples a pixel.
Image draw(const std::vector<PictureSurface>& surfaces, const std::vector<PictureFloor>& floors,
           const Camera& camera, int width, int height);

}  // namespace nbd

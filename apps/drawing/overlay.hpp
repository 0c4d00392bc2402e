#pragma once

#include <Eigen/Core>
#include <string_view>

#include "apps/drawing/picture.hpp"

namespace nbd {

/// An arrow over a picture. Lengths and places in pixels, from the upper left corner.
struct OverlayArrow {
    Eigen::Vector2f from{0, 0}, to{0, 0};
    float width = 3;  // of the shaft
    int heads = 1;    // one behind the other
    Eigen::Vector3f colour{0, 0, 0};
};

/// Draws an arrow with smooth edges and a thin white seam. What lies outside of the picture is cut.
void draw_arrow(Image& image, const OverlayArrow& arrow);

/// Width of a letter and its gap, and height of a line, pixels of a text of size 1.
inline constexpr int letter_width = 6, letter_height = 7;

/// Writes a line in dark letters of 5 x 7 squares of `size` pixels. It knows digits, the full stop, the
/// blank and the letters of "force", "torque" and units; others are left blank.
void draw_text(Image& image, int left, int top, std::string_view text, int size);

}  // namespace nbd

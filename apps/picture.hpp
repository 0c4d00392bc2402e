#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "collision/geometry.hpp"

namespace nbd {

/// An 8-bit RGB image, rows from the top.
struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;  // [height * width * 3]
};

/// A camera that looks from `eye` at `target`, z up, without perspective: `extent` metres fit the height.
struct Camera {
    Eigen::Vector3f eye{1, -1.6f, 0.7f}, target{0, 0, 0};
    float extent = 2;
};

/// One surface of a picture.
struct PictureSurface {
    VerticesRef x;
    FacesRef F;
    Eigen::Vector3f colour;  // 0 to 1
};

/// Draws the surfaces with a z-buffer and one light, no display needed. Four samples a pixel.
Image draw(const std::vector<PictureSurface>& surfaces, const Camera& camera, int width, int height);

/// Images of one size side by side, row by row.
Image contact_sheet(const std::vector<Image>& images, int columns);

/// Writes atomically. Throws std::runtime_error with path and reason.
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace nbd

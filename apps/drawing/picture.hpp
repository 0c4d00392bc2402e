#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// An 8-bit RGB image, rows from the top.
struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;  // [height * width * 3]
};

/// Orthographic camera that looks along `forward`.
struct Camera {
    Eigen::Vector3f target{0, 0, 0};  // at the centre of the picture
    Eigen::Vector3f forward{0, 1, 0}, up{0, 0, 1};
    float extent = 2;  // height of the picture, metres

    /// Position of a point relative to the target: metres right, up and forward.
    Eigen::Vector3f seen(const Eigen::Vector3f& p) const;
};

/// One surface of a picture.
struct PictureSurface {
    Vertices x;
    Faces F;
    Eigen::Vector3f colour;  // 0 to 1
};

/// Floor below the surfaces that fades out around them. Invisible from behind.
struct PictureFloor {
    Eigen::Vector3f point, normal;  // unit
    float grid = 0.1f;              // metres between grid lines
};

/// Draws surfaces and floors with smooth shading, sharp creases and the shadows of one light. Needs no
/// display. Nine samples per pixel.
Image draw(const std::vector<PictureSurface>& surfaces, const std::vector<PictureFloor>& floors,
           const Camera& camera, int width, int height);

/// Arranges images of one size in a grid, row by row.
Image contact_sheet(const std::vector<Image>& images, int columns);

/// Writes atomically. Throws std::runtime_error with path and reason.
void write_png(const std::filesystem::path& path, const Image& image);

/// Colours of bodies in pictures, sRGB from 0 to 1; body b has the one at b modulo their number. Those of
/// apps/view/page/colours.js.
inline const std::array<Eigen::Vector3f, 6> body_colours{
    Eigen::Vector3f{0.36f, 0.68f, 0.45f}, Eigen::Vector3f{0.35f, 0.56f, 0.86f},
    Eigen::Vector3f{0.95f, 0.66f, 0.28f}, Eigen::Vector3f{0.66f, 0.48f, 0.80f},
    Eigen::Vector3f{0.88f, 0.42f, 0.40f}, Eigen::Vector3f{0.35f, 0.72f, 0.74f}};

}  // namespace nbd

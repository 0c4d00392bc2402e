#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace nbd {

/// An 8-bit RGB image, rows from the top.
struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;  // [height * width * 3]
};

/// Arranges images of one size in a grid, row by row.
Image contact_sheet(const std::vector<Image>& images, int columns);

/// Writes atomically. Throws std::runtime_error with path and reason.
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace nbd

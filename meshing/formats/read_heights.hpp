#pragma once

#include <Eigen/Core>
#include <filesystem>

namespace nbd {

/// Most heights along a side that are read.
inline constexpr int most_heights = 2048;

/// Whether a name is that of a grey image: .png or .pgm.
bool is_grey_image(const std::filesystem::path& path);

/// The brightness of the pixels of a grey image of 8 or 16 bits, 0 (black) to 1 (white), as they are stored,
/// without a correction for screens; row 0 is the lowest one of the image. Throws a one-line
/// std::runtime_error that starts with the path for a file that cannot be read, has colours or is cut off,
/// and for sides of less than 2 or more than most_heights pixels.
Eigen::MatrixXd read_grey_image(const std::filesystem::path& path);

/// The numbers of a table: rows in lines, with commas, semicolons or white space between the numbers; what
/// follows a # is a comment. Throws likewise for what is no number, and rows of different lengths.
Eigen::MatrixXd read_number_table(const std::filesystem::path& path);

}  // namespace nbd

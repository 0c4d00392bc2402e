#pragma once

#include <Eigen/Core>
#include <array>

namespace nbd {

/// Colours of bodies in pictures, sRGB from 0 to 1; body b has the one at b modulo their number. Those of
/// apps/view/page/colours.js.
inline const std::array<Eigen::Vector3f, 6> body_colours{
    Eigen::Vector3f{0.36f, 0.68f, 0.45f}, Eigen::Vector3f{0.35f, 0.56f, 0.86f},
    Eigen::Vector3f{0.95f, 0.66f, 0.28f}, Eigen::Vector3f{0.66f, 0.48f, 0.80f},
    Eigen::Vector3f{0.88f, 0.42f, 0.40f}, Eigen::Vector3f{0.35f, 0.72f, 0.74f}};

}  // namespace nbd

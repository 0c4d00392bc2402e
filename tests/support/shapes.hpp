#pragma once

#include <random>

#include "collision/geometry/geometry.hpp"
#include "collision/nbd_tree/modal_coordinates.hpp"

namespace nbd::shapes {

/// Closed, outward-oriented surfaces from formulas, and poses of them.
struct Surface {
    Vertices X;
    Faces F;
};

/// A torus: a grid of rows x columns quads, closed in both directions. Radii in metres.
Surface torus(int rows, int columns, float major = 0.5f, float minor = 0.2f);

Surface sphere(int rows, int columns, float r = 0.5f);

/// A round bar along z.
Surface bar(int rows, int columns, float length = 1.2f, float r = 0.15f);

/// Uniform in [-1, 1]. Computed from the generator's bits, so all platforms give the same numbers.
float uniform(std::mt19937& random);

Eigen::Vector3f uniform3(std::mt19937& random);

/// A random rotation and a translation of at most `reach` along each axis.
RigidTransform random_motion(std::mt19937& random, float reach);

Vertices moved(const Vertices& X, const RigidTransform& motion);

/// Adds smooth waves of about `amount` metres, with wavelengths near the size of the body.
Vertices wobbled(const Vertices& X, std::mt19937& random, float amount);

}  // namespace nbd::shapes

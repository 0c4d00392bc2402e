#pragma once

#include <cmath>
#include <numbers>

#include "collision/geometry/geometry.hpp"

/// Surface of the examples: plain arrays, as from a simulator or a file reader.
struct Surface {
    nbd::Vertices x;  // [n, 3] metres
    nbd::Faces F;     // [m, 3]
};

/// A closed ball around the origin: 24 x 32 vertices on it and the two poles, 1536 faces. radius: metres.
inline Surface ball(float radius) {
    constexpr int rows = 24, columns = 32, south = rows * columns, north = south + 1;
    constexpr float pi = std::numbers::pi_v<float>;
    Surface s{nbd::Vertices(north + 1, 3), nbd::Faces(2 * rows * columns, 3)};
    s.x.row(south) << 0, 0, -radius;
    s.x.row(north) << 0, 0, radius;
    int f = 0;
    for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) {
            const float latitude = pi * (static_cast<float>(i + 1) / (rows + 1) - 0.5f);
            const float longitude = 2 * pi * static_cast<float>(j) / columns;
            const int here = i * columns + j, next = i * columns + (j + 1) % columns;
            s.x.row(here) << std::cos(latitude) * std::cos(longitude),
                std::cos(latitude) * std::sin(longitude), std::sin(latitude);
            s.x.row(here) *= radius;
            if (i == 0) s.F.row(f++) << south, next, here;
            if (i == rows - 1) s.F.row(f++) << north, here, next;
            if (i == rows - 1) continue;
            s.F.row(f++) << here, next, next + columns;
            s.F.row(f++) << here, next + columns, here + columns;
        }
    return s;
}

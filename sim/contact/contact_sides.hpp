#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace nbd {

/// How far surface vertices have been within the contact distance of another body, of their own one, or of an
/// obstacle, ever since the start. Contact begins that much nearer for them, so that what touches or overlaps
/// at the start is not thrown apart. A vertex that moves away has the full distance again. Flat arrays of
/// equal length.
struct StartDepths {
    std::vector<std::array<int, 3>>
        vertices;                   // (body, other body or -1 - obstacle, surface vertex), each once
    std::vector<double> depths;     // metres, > 0
    int bodies = 0, obstacles = 0;  // those that have been started with
};

/// Sides by which surface vertices came into contact with other bodies, and their depths. Flat arrays of
/// equal length, so that a file can store them.
struct ContactSides {
    std::vector<std::array<int, 3>> vertices;  // (body, other body, surface vertex), each once
    std::vector<Eigen::Vector3d> normals;      // unit, outward from the other body
    std::vector<double> depths;                // metres behind the other body's surface, >= 0
    StartDepths starts{};
};

/// The last contact of a vertex: the side by which it came, and how far it was behind the surface, metres.
struct VertexSide {
    int vertex = 0;
    Eigen::Vector3d normal;
    double depth = 0;
};
using VertexSides = std::vector<VertexSide>;  // of one body against one other, or itself, by ascending vertex

/// The largest depth; 0 if there are none.
double deepest(const VertexSides& sides) noexcept;

/// Appends the sides of the vertices of `body` against `other`.
void append(const VertexSides& sides, int body, int other, ContactSides& all);

/// Those that append() added for these bodies.
VertexSides sides_of(const ContactSides& all, int body, int other);

}  // namespace nbd

#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <functional>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// A surface of a clip.
struct ClipBody {
    std::string name;
    Faces F;
    int vertex_count = 0;
};

/// Surfaces that move, as programs of artists take them, metres.
struct Clip {
    std::string title;
    Eigen::Vector3d up{0, 0, 1};      // unit
    Eigen::Vector3d origin{0, 0, 0};  // what positions are counted from
    std::vector<double> times;        // [frames] seconds, ascending, at least one
    std::vector<ClipBody> bodies;
    /// The surface of a body in a frame, [vertex_count, 3].
    std::function<void(int body, int frame, Vertices& x)> read;

    int frames() const noexcept { return times.size(); }
    /// Seconds since the first frame.
    float time(int frame) const { return static_cast<float>(times[frame] - times.front()); }
};

/// Unit normals at the vertices: sums of the normals of the faces around each, by area. Vertices without any
/// get +z. n: out, [vertices, 3].
void smooth_normals(VerticesRef x, FacesRef F, Vertices& n);

/// Most frames of a clip as glTF: each one after the first is a morph target, which programs hold in memory.
inline constexpr int most_glb_frames = 240;

/// Writes a clip as binary glTF 2.0. Each body is a mesh of its own whose vertices are those of the surface,
/// in order and in world space; its first frame is the mesh, each other one a morph target with positions and
/// normals, and an animation goes from one to the next at their times. A node above them turns `up` to +y.
/// Throws std::invalid_argument for more than most_glb_frames frames, or more than the 4 GiB that a file can
/// hold.
void write_glb(std::ostream& out, const Clip& clip);

/// Writes the vertices of a body in all frames as a LightWave point cache (.mdd): numbers of frames and
/// vertices, the frames' times from 0 on, positions; big-endian, 4 bytes each.
void write_mdd(std::ostream& out, const Clip& clip, int body);

/// Likewise as a point cache of 3ds Max (.pc2), little-endian: it has no times, one sample is one frame.
void write_pc2(std::ostream& out, const Clip& clip, int body);

/// Writes numbers of four bytes in the byte order of a file format.
template <std::endian order, class Number>
void write_numbers(std::ostream& out, std::span<const Number> numbers) {
    static_assert(sizeof(Number) == 4);
    std::string bytes;
    bytes.reserve(4 * numbers.size());
    for (const Number number : numbers) {
        auto raw = std::bit_cast<std::array<char, 4>>(number);
        if constexpr (order != std::endian::native) std::ranges::reverse(raw);
        bytes.append(raw.data(), raw.size());
    }
    out.write(bytes.data(), bytes.size());
}

template <std::endian order, class Number>
void write_number(std::ostream& out, Number number) {
    write_numbers<order>(out, std::span<const Number>(&number, 1));
}

}  // namespace nbd

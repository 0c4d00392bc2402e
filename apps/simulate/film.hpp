#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <span>
#include <vector>

#include "apps/drawing/picture.hpp"
#include "meshing/surface/mesh.hpp"
#include "sim/scene/scene.hpp"

namespace nbd {

/// Picture of a scene: a few frames side by side, each body in its own colour, on the scene's floor.
class Film {
 public:
    /// The picture shows at most `stills` evenly spread frames, including the start and the last one. stills:
    /// at least 2. obstacles: of the world that the frames are of.
    Film(const SceneSpec& spec, std::span<const Obstacle> obstacles, int stills);

    /// True if the picture shows this frame; the start is 0.
    bool wants(int frame) const;

    /// Adds a frame. Call in order, only for frames that the picture shows. surfaces: [bodies].
    void add_frame(double time, std::vector<TriMesh> surfaces);

    /// Writes the added frames as a PNG. Throws std::runtime_error with path and reason.
    void write(const std::filesystem::path& path) const;

 private:
    struct Still {
        double time;                    // seconds
        std::vector<TriMesh> surfaces;  // [bodies]
    };

    void extend(Eigen::AlignedBox3f& seen, const Obstacle& obstacle, const Camera& camera) const;

    int frames_, stills_;
    Eigen::Vector3d gravity_;
    std::vector<Obstacle> obstacles_;
    std::vector<Still> kept_;
};

}  // namespace nbd

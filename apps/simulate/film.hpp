#pragma once

#include <filesystem>
#include <vector>

#include "meshing/surface/mesh.hpp"
#include "sim/scene/scene.hpp"

namespace nbd {

/// A scene in one picture: a few frames side by side, each body in a colour of its own, on the scene's floor.
class Film {
 public:
    /// Of the scene's frames, the start among them, at most `stills` evenly spread ones are shown, the first
    /// and the last too. stills: at least 2.
    Film(const SceneSpec& spec, int stills);

    /// Whether the picture shows this frame; the start is 0.
    bool wants(int frame) const;

    /// surfaces: [bodies]. Frames come in order, those that the picture wants alone.
    void add_frame(double time, std::vector<TriMesh> surfaces);

    /// Writes what it has as a PNG. Throws std::runtime_error with path and reason.
    void write(const std::filesystem::path& path) const;

 private:
    struct Still {
        double time;                    // seconds
        std::vector<TriMesh> surfaces;  // [bodies]
    };

    int frames_, stills_;
    Eigen::Vector3d gravity_;
    std::vector<SceneObstacle> obstacles_;
    std::vector<Still> kept_;
};

}  // namespace nbd

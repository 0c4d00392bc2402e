#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "training/files/recording.hpp"
#include "training/files/surface_body.hpp"

namespace nbd::test {

/// A bar of 4 x 1 x 1 m with a grid of surface vertices, moved by a coarse lattice of nodes. It gives smooth
/// modes and poses without the mesher and the simulator.
struct Bar {
    static constexpr int columns = 9;  // along x, with four nodes each
    static constexpr int nodes = 4 * columns;
    SurfaceBody body;
    Vertices rest;  // [nodes, 3]

    explicit Bar(int modes = 12, int cells = 6);

    /// Bent in the x-z plane, twisted about x and stretched along x, then moved rigidly. Angles are in
    /// radians over the whole bar.
    Vertices pose(double bend, double twist, double stretch, const Eigen::Quaterniond& turn,
                  const Eigen::Vector3d& move) const;

    /// Frame of a trajectory with amplitudes, turn and phase derived from (seed, trajectory).
    Vertices frame(std::uint64_t seed, int trajectory, int frame) const;

    /// Records `trajectories` with `frames` frames each; those in `failed` end in a failure.
    void record(const std::filesystem::path& path, int trajectories, int frames, std::uint64_t seed,
                const std::vector<int>& failed = {}) const;

    /// Records these poses as the frames of one trajectory, and reads them.
    RecordingReader recorded(const std::filesystem::path& path, const std::vector<Vertices>& poses) const;
};

}  // namespace nbd::test

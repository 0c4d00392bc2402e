#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// One body of a frame. All pointers are required; they are read only during the call.
struct VtuBody {
    const TetMesh* mesh = nullptr;               // at rest
    const Nodes* start = nullptr;                // [N, 3] reference positions of the displacements, metres
    const Nodes* x = nullptr;                    // [N, 3] current positions, metres
    const Nodes* v = nullptr;                    // [N, 3] velocities, m/s
    const Nodes* contact_force = nullptr;        // [N, 3] newtons
    const Eigen::VectorXd* von_mises = nullptr;  // [T] stress, Pa
};

/// Writes one frame as a VTK unstructured grid (.vtu, raw appended data, float32) with the cell fields `body`
/// (number) and `von_mises` (Pa) and the point fields `displacement` (x minus start, metres), `velocity`
/// (m/s) and `contact_force` (N). Quadratic tetrahedra are VTK's, whose points in the middle of edges lie on
/// the curved edge, so these have the place and the velocity of the body there, and the force on the node of
/// the edge. Atomic. Throws std::invalid_argument if shapes disagree, std::runtime_error with path and reason
/// if writing fails. origin: what x and start are counted from; points are written with it, in float64 unless
/// it is zero.
void write_vtu(const std::filesystem::path& path, std::span<const VtuBody> bodies,
               const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());

/// A directory of frames that ParaView opens as one animation: NAME_000000.vtu, ..., and NAME.pvd, which is
/// up to date after every frame.
class VtuSeries {
 public:
    /// Creates the directory if needed. Throws std::runtime_error with path and reason.
    VtuSeries(std::filesystem::path directory, std::string name);

    /// time: seconds. Frames are numbered from 0 in call order.
    void add_frame(double time, std::span<const VtuBody> bodies,
                   const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());

    std::filesystem::path pvd() const { return directory_ / (name_ + ".pvd"); }

 private:
    std::string frame_name(std::size_t frame) const;

    std::filesystem::path directory_;
    std::string name_;
    std::vector<double> times_;
};

}  // namespace nbd

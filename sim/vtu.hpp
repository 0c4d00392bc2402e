#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "meshing/mesh.hpp"

namespace nbd {

/// One body of a frame. The pointers are read during the call only.
struct VtuBody {
    const TetMesh* rest = nullptr;
    const Nodes* x = nullptr;  // [N, 3] current positions, metres
    const Nodes* v = nullptr;  // [N, 3] velocities, m/s
};

/// Writes one frame as a VTK unstructured grid (.vtu, raw appended data, float32) with the cell field `body`
/// and the point fields `displacement` (x minus rest, metres) and `velocity` (m/s). Atomic.
/// Throws std::invalid_argument where shapes disagree, std::runtime_error with path and reason.
void write_vtu(const std::filesystem::path& path, std::span<const VtuBody> bodies);

/// A directory of frames that ParaView opens as one animation: NAME_000000.vtu, ..., and NAME.pvd, which is
/// complete after every frame.
class VtuSeries {
 public:
    /// Creates the directory where needed. Throws std::runtime_error with path and reason.
    VtuSeries(std::filesystem::path directory, std::string name);

    /// time: seconds. Frames are numbered from 0 in the order of the calls.
    void add_frame(double time, std::span<const VtuBody> bodies);

    /// Counts a frame that an earlier run wrote: it stands in the .pvd from the next add_frame on.
    void keep_frame(double time);

    std::filesystem::path pvd() const { return directory_ / (name_ + ".pvd"); }

 private:
    std::string frame_name(std::size_t frame) const;

    std::filesystem::path directory_;
    std::string name_;
    std::vector<double> times_;
};

}  // namespace nbd

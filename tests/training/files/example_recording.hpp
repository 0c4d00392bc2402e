#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>

#include "training/files/recording.hpp"

namespace nbd::test {

/// Frame `frame` of trajectory `id`, with different numbers everywhere.
inline Vertices frame_of(int id, int frame, int nodes) {
    Vertices x(nodes, 3);
    for (int i = 0; i < x.size(); ++i) x.data()[i] = std::sin(static_cast<float>(i + 1000 * frame + 77 * id));
    return x;
}

inline TrajectoryInfo info_of(int id) {
    return {id,
            ~std::uint64_t{0} - static_cast<unsigned>(id),
            std::string(64, 'a'),
            "{\"excitation\": " + std::to_string(id) + "}",
            "",
            0};
}

/// Writes `count` trajectories with 10 + id frames of 7 nodes; the second one failed.
inline void write_recording(const std::filesystem::path& path, int count) {
    RecordingWriter file(path);
    for (int id = 0; id < count; ++id) {
        const int handle = file.begin_trajectory(info_of(id), 7);
        for (int frame = 0; frame < 10 + id; ++frame)
            file.add_frame(handle, frame * 0.1, frame_of(id, frame, 7));
        file.end_trajectory(handle, id == 1 ? "tetrahedron 3 inverted" : "");
    }
    file.finish();
}

}  // namespace nbd::test

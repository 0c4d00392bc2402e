#pragma once

#include <string>

#include "meshing/body/body.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// A body that recordings are checked against.
struct CheckedBody {
    Body body;
    std::string hash;  // body_hash()
    std::string file;  // for messages
};

/// Checks what a recording holds: every frame is read, groups have the names of their ids, contact edges
/// refer to trajectories of the file and to faces. body: null, or the body that all trajectories must be of.
/// Throws std::runtime_error, one line with the path of the file.
void check_recording(const RecordingReader& recording, const CheckedBody* body);

}  // namespace nbd

#pragma once

#include <functional>
#include <string>

#include "training/files/recording.hpp"

namespace nbd {

/// Hex SHA-256 over all trajectories' ids, sizes, failures and positions: names the data, wherever and in
/// whatever file they lie. Reads the whole recording, piece by piece. seen: gets the nodes of `count` frames
/// from frame `begin` of each piece, [count * N, 3], pieces in order; may be empty. Throws what
/// RecordingReader::read and `seen` throw.
std::string recording_hash(
    const RecordingReader& recording,
    const std::function<void(int trajectory, int begin, int count, const Vertices& nodes)>& seen = {});

}  // namespace nbd

#pragma once

#include <functional>
#include <string>

#include "training/files/recording.hpp"

namespace nbd {

/// Hex SHA-256 over the ids, sizes, failures and positions of all trajectories: identifies the data whatever
/// file holds them. Reads the whole recording in pieces. seen: receives the nodes of `count` frames from
/// frame `begin` of each piece, [count * N, 3], in order; may be empty. Throws what RecordingReader::read and
/// `seen` throw.
std::string recording_hash(
    const RecordingReader& recording,
    const std::function<void(int trajectory, int begin, int count, const Vertices& nodes)>& seen = {});

}  // namespace nbd

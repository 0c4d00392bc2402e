#pragma once

#include <string>

#include "training/files/recording.hpp"

namespace nbd {

/// Hex SHA-256 over all trajectories' ids, sizes, failures and positions: names the data, wherever and in
/// whatever file they lie. Reads the whole recording, piece by piece. Throws what RecordingReader::read does.
std::string recording_hash(const RecordingReader& recording);

}  // namespace nbd

#pragma once

#include <string>

#include "training/files/recording.hpp"

namespace nbd {

/// Hex SHA-256 over the ids, sizes, failures and positions of all trajectories. Identifies the data, whatever
/// files hold it. Reads the whole recording, piece by piece. Throws what RecordingReader::read() throws.
std::string recording_hash(const RecordingReader& recording);

}  // namespace nbd

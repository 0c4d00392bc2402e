#pragma once

#include <string>

#include "training/files/recording.hpp"

namespace nbd {

/// The values that trajectories of a scene were drawn with (CSV), a line for each: its number, how often it
/// was drawn again, each variable, vectors and rotations by their members, its frames, and why it failed.
std::string value_table(const RecordingReader& dataset);

}  // namespace nbd

#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "apps/simulate/step_table.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// A frame of a simulation with all that its outputs show and all that the next step depends on: what the
/// journal of a run holds.
struct SimulationFrame {
    int number = 0;  // 0: the start
    WorldSnapshot world;
    std::vector<Nodes> contact_forces;  // [bodies] of the frame's last step, N
    std::vector<StepRow> steps;         // that led to it
};

/// The world as it is now. steps: since the last frame.
SimulationFrame take_frame(int number, const World& world, std::vector<StepRow> steps);

/// A frame as bytes, for this very program to read again.
std::string to_bytes(const SimulationFrame& frame);

/// Throws std::runtime_error where the bytes are no frame.
SimulationFrame frame_from(std::string_view bytes);

}  // namespace nbd

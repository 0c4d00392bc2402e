#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/simulate/reaction_table.hpp"
#include "apps/simulate/step_table.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// A simulation frame as the journal stores it: everything that the outputs show and the next step depends
/// on.
struct SimulationFrame {
    int number = 0;  // 0: the start
    WorldSnapshot world;
    std::vector<Nodes> contact_forces;     // [bodies] in the frame's last step, N
    std::vector<StepRow> steps;            // since the previous frame
    std::vector<StepReactions> reactions;  // of these steps
};

/// Those of the last step; none at the start.
inline std::span<const Reaction> last_reactions(const SimulationFrame& frame) {
    if (frame.reactions.empty()) return {};
    return frame.reactions.back().all;
}

/// Captures the current world. steps, reactions: since the previous frame.
SimulationFrame take_frame(int number, const World& world, std::vector<StepRow> steps,
                           std::vector<StepReactions> reactions);

/// Serialises a frame; only the same program can read the bytes.
std::string to_bytes(const SimulationFrame& frame);

/// Reads what to_bytes() wrote. Throws std::runtime_error if the bytes are not a frame.
SimulationFrame frame_from(std::string_view bytes);

}  // namespace nbd

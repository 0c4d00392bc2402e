#include "apps/cli/rank.hpp"

#include <cstdlib>
#include <optional>

#include "meshing/formats/words.hpp"

namespace nbd {
namespace {

std::optional<int> from_environment(const char* name) {
    const char* text = std::getenv(name);
    const auto value = text ? plain_number_in<int>(text) : std::nullopt;
    return value && *value >= 0 ? value : std::nullopt;
}

struct Launcher {
    const char *number, *count, *on_this_machine;
};

constexpr Launcher launchers[] = {
    {"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_LOCAL_SIZE"},
    {"PMI_RANK", "PMI_SIZE", "MPI_LOCALNRANKS"},
    {"SLURM_PROCID", "SLURM_STEP_NUM_TASKS", "SLURM_NTASKS_PER_NODE"},
};

}  // namespace

Rank this_rank() {
    for (const Launcher& launcher : launchers) {
        const auto number = from_environment(launcher.number), count = from_environment(launcher.count);
        if (!number || !count || *number >= *count) continue;
        const int here = from_environment(launcher.on_this_machine).value_or(1);
        return {*number, *count, here > 0 ? here : 1};
    }
    return {};
}

}  // namespace nbd

#include "apps/sharing/rank.hpp"

#include <charconv>
#include <cstdlib>
#include <cstring>
#include <optional>

namespace nbd {
namespace {

std::optional<int> from_environment(const char* name) {
    const char* text = std::getenv(name);
    if (!text) return {};
    int value = 0;
    const char* end = text + std::strlen(text);
    const auto [rest, error] = std::from_chars(text, end, value);
    if (error != std::errc() || rest != end || value < 0) return {};
    return value;
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

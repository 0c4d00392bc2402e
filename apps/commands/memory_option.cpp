#include "apps/commands/memory_option.hpp"

#include "apps/cli/option_checks.hpp"
#include "training/files/frame_source.hpp"

namespace nbd {

void add_memory_option(CLI::App& command, std::optional<std::size_t>& memory) {
    command
        .add_option("--memory", memory,
                    "MiB of positions kept in memory at most, so that the recording is read fewer times; "
                    "default: a quarter of this machine's memory")
        ->check(whole_number(0, std::int64_t{1} << 30));
}

std::size_t frame_memory(const std::optional<std::size_t>& memory) {
    return memory ? *memory << 20 : default_frame_memory();
}

}  // namespace nbd

#include "apps/bench/commands/bench_commands.hpp"

#include "apps/cli/option_checks.hpp"

namespace nbd {

void add_bodies(CLI::App& command, std::vector<std::vector<std::string>>& bodies) {
    command
        .add_option(
            "--body", bodies,
            "Body file, and optionally a tree file trained on it; repeat for each size, coarsest first")
        ->required()
        ->expected(1, 2);
}

void add_race_limits(CLI::App& command, RaceConfig& race) {
    command.add_option("--rounds", race.rounds, "Maximum rounds over all scenes")
        ->check(whole_number(1, 1'000'000))
        ->capture_default_str();
    command
        .add_option("--seconds", race.max_seconds,
                    "Maximum seconds per method and case, after the first round")
        ->check(positive())
        ->capture_default_str();
}

}  // namespace nbd

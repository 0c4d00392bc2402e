#include "apps/bench/commands/bench_options.hpp"

#include "apps/cli/option_checks.hpp"

namespace nbd {

void add_bodies(CLI::App& command, std::vector<std::vector<std::string>>& bodies) {
    command
        .add_option("--body", bodies,
                    "Body file, and a tree file trained on it; once a size, the coarsest first")
        ->required()
        ->expected(1, 2);
}

void add_race_limits(CLI::App& command, RaceConfig& race) {
    command.add_option("--rounds", race.rounds, "Rounds over all scenes, at most")
        ->check(CLI::Range(1, 1'000'000))
        ->capture_default_str();
    command.add_option("--seconds", race.max_seconds, "Most time a method and case, after a round")
        ->check(positive())
        ->capture_default_str();
}

}  // namespace nbd

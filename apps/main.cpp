// The command `nbdtree`: exit status 0 done, 1 failed, 2 wrong usage, 130 interrupted.
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <exception>
#include <new>
#include <optional>
#include <thread>

#include "apps/commands/commands.hpp"
#include "apps/dataset/rank.hpp"
#include "apps/interrupt.hpp"
#include "collision/kernels/kernels.hpp"

namespace {

/// Errors are one line, whatever a library below has said.
int fail(int status, std::string_view message) {
    fmt::print(stderr, "nbdtree: error: {}\n", message.substr(0, message.find('\n')));
    return status;
}

/// "frob" where the command line names it in place of a command, and what is known.
std::string unknown_command(const CLI::App& app) {
    std::string names;
    for (const CLI::App* command : app.get_subcommands(nullptr))
        names += (names.empty() ? "" : ", ") + command->get_name();
    const std::vector<std::string> rest = app.remaining();
    return fmt::format(
        "{}; known commands: {}",
        rest.empty() ? "no command" : fmt::format("unknown command or option '{}'", rest.front()), names);
}

/// An argument as a shell takes it.
std::string quoted(std::string_view argument) {
    const bool plain = !argument.empty() && std::ranges::all_of(argument, [](unsigned char c) {
        return std::isalnum(c) ||
               std::string_view("_-+=./,:@%").find(static_cast<char>(c)) != std::string_view::npos;
    });
    if (plain) return std::string(argument);
    std::string text = "'";
    for (const char c : argument) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

/// An argument that a script's unset variable left empty is a mistake, not the same as none.
std::string not_empty(const std::string& text) { return text.empty() ? "must not be empty" : ""; }

/// Has queries use the kernels that the command line names.
void choose_kernels(const std::string& instructions) {
    using nbd::InstructionSet;
    const auto refuse = [&](const std::string& why) {
        throw CLI::ValidationError("--instructions", fmt::format("'{}'; {}", instructions, why));
    };
    for (const InstructionSet set : {InstructionSet::plain, InstructionSet::avx2, InstructionSet::avx512})
        if (instructions == name(set)) {
            const nbd::Kernels* form = nbd::kernels_for(set);
            if (!form) refuse("this machine has not these instructions");
            return use_kernels(*form);
        }
    refuse("allowed: plain, avx2 and avx512");
}

/// A result that a full disk swallowed is a failure.
int flush_output() {
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return 0;
    return fail(1, fmt::format("standard output: cannot write: {}", std::strerror(errno)));
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app("Deformable solids with learned collision culling.", "nbdtree");
    app.set_version_flag("--version", "nbdtree " NBD_VERSION);
    app.require_subcommand(1);
    app.fallthrough();  // --quiet and its like may stand after the command's own options

    nbd::Output out;
    for (int i = 0; i < argc; ++i) out.command_line += (i == 0 ? "" : " ") + quoted(argv[i]);
    int threads = 0;
    app.add_flag("-q,--quiet", out.quiet, "No progress and no tables; errors and warnings alone");
    app.add_flag("--json", out.json, "The result as one JSON object on standard output");
    app.add_option("--threads", threads,
                   "Threads to use; 0: all cores, shared by mpirun's ranks. The result does not depend on it")
        ->check(CLI::Range(0, 1024));
    app.add_option_function<std::string>(
        "--instructions", choose_kernels,
        "Kernels of collision queries: plain, avx2 or avx512; without it the best that the machine runs. The "
        "result does not depend on it");

    nbd::add_mesh(app, out);
    nbd::add_modes(app, out);
    nbd::add_dataset(app, out);
    nbd::add_carry(app, out);
    nbd::add_train(app, out);
    nbd::add_calibrate(app, out);
    nbd::add_evaluate(app, out);
    nbd::add_figures(app, out);
    nbd::add_transfer(app, out);
    nbd::add_export(app, out);
    nbd::add_trust(app, out);
    nbd::add_simulate(app, out);
    nbd::add_validate(app, out);
    nbd::add_collide(app, out);
    nbd::add_inspect(app, out);
    nbd::add_bench(app, out);

    for (CLI::App* command : app.get_subcommands(nullptr))
        for (CLI::Option* option : command->get_options())
            if (option->get_expected_max() > 0) option->check(not_empty);

    // The commands are final callbacks: they run once everything, --threads included, has been parsed.
    std::optional<tbb::global_control> limit;
    app.parse_complete_callback([&] {
        const auto mates = static_cast<unsigned>(nbd::this_rank().on_this_machine);
        const std::size_t count = threads > 0 ? static_cast<std::size_t>(threads)
                                              : std::max(1u, std::thread::hardware_concurrency() / mates);
        limit.emplace(tbb::global_control::max_allowed_parallelism, count);
        nbd::catch_interrupts();
    });

    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& request) {
        return app.exit(request);
    } catch (const CLI::RequiredError& error) {
        return fail(2, app.get_subcommands().empty() ? unknown_command(app) : error.what());
    } catch (const CLI::ParseError& error) {
        return fail(2, error.what());
    } catch (const nbd::Interrupted& stop) {
        out.end_progress();
        return fail(130, fmt::format("interrupted: {}", stop.what()));
    } catch (const std::bad_alloc&) {
        return fail(1, "out of memory");
    } catch (const std::exception& error) {
        out.end_progress();
        return fail(1, error.what());
    }
    return flush_output();
}

#include "apps/cli/program.hpp"

#include <tbb/global_control.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <exception>
#include <mutex>
#include <new>
#include <optional>
#include <set>
#include <thread>

#include "apps/cli/interrupt.hpp"
#include "apps/sharing/rank.hpp"
#include "collision/base/notice.hpp"
#include "collision/kernels/kernels.hpp"
#include "meshing/h5/version.hpp"

namespace nbd {
namespace {

/// Errors are one line, whatever a library below has said.
int fail(std::string_view program, int status, std::string_view message) {
    fmt::print(stderr, "{}: error: {}\n", program, message.substr(0, message.find('\n')));
    return status;
}

/// "frob" where the command line names it in place of a command, and what is known.
std::string unknown_command(const CLI::App& app) {
    std::string names;
    for (const CLI::App* command :
         app.get_subcommands([](const CLI::App* c) { return !c->get_group().empty(); }))
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
    const auto refuse = [&](const std::string& why) {
        throw CLI::ValidationError("--instructions", fmt::format("'{}'; {}", instructions, why));
    };
    for (const InstructionSet set : {InstructionSet::plain, InstructionSet::avx2, InstructionSet::avx512})
        if (instructions == name(set)) {
            const Kernels* form = kernels_for(set);
            if (!form) refuse("this machine has not these instructions");
            return use_kernels(*form);
        }
    refuse("allowed: plain, avx2 and avx512");
}

/// The arguments after the program's name, last first as CLI11 takes them, with today's name of the command.
std::vector<std::string> arguments_of(const Program& program, const CLI::App& app, int argc, char** argv) {
    std::vector<std::string> arguments(argv + 1, argv + argc);
    const auto is_command = [&](const std::string& argument) {
        return std::ranges::any_of(app.get_subcommands(nullptr),
                                   [&](const CLI::App* command) { return command->get_name() == argument; });
    };
    bool has_command = false;
    for (std::string& argument : arguments) {
        const bool is_option = argument.starts_with("--");
        if (!is_option && has_command) continue;
        has_command = has_command || is_command(argument);
        const auto old = program.old_names.find(argument);
        if (old == program.old_names.end()) continue;
        notice(fmt::format("`{0} {1}` is called `{0} {2}` now; release 0.3 will not know the old name",
                           program.name, old->first, old->second));
        argument = old->second;
        has_command = has_command || !is_option;
    }
    std::ranges::reverse(arguments);
    return arguments;
}

/// A result that a full disk swallowed is a failure.
int flush_output(std::string_view program) {
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return 0;
    return fail(program, 1, fmt::format("standard output: cannot write: {}", std::strerror(errno)));
}

/// Warnings of the libraries; a line that was said is not said again.
void say_once(std::string_view line) {
    static std::mutex mutex;
    static std::set<std::string, std::less<>> said;
    const std::lock_guard lock(mutex);
    if (said.emplace(line).second) fmt::print(stderr, "nbdtree: warning: {}\n", line);
}

}  // namespace

int run_program(const Program& program, int argc, char** argv) {
    CLI::App app(program.description, program.name);
    app.set_version_flag("--version", fmt::format("{} {}", program.name, build_version()));
    app.require_subcommand(1);
    app.fallthrough();  // --quiet and its like may stand after the command's own options

    set_notice_handler(say_once);
    Output out;
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

    program.add_commands(app, out);

    for (CLI::App* command : app.get_subcommands(nullptr))
        for (CLI::Option* option : command->get_options())
            if (option->get_expected_max() > 0) option->check(not_empty);

    // The commands are final callbacks: they run once everything, --threads included, has been parsed.
    std::optional<tbb::global_control> limit;
    app.parse_complete_callback([&] {
        const auto mates = static_cast<unsigned>(this_rank().on_this_machine);
        const std::size_t count = threads > 0 ? static_cast<std::size_t>(threads)
                                              : std::max(1u, std::thread::hardware_concurrency() / mates);
        limit.emplace(tbb::global_control::max_allowed_parallelism, count);
        catch_interrupts();
    });

    try {
        app.parse(arguments_of(program, app, argc, argv));
    } catch (const CLI::Success& request) {
        return app.exit(request);
    } catch (const CLI::RequiredError& error) {
        return fail(program.name, 2, app.get_subcommands().empty() ? unknown_command(app) : error.what());
    } catch (const CLI::ParseError& error) {
        return fail(program.name, 2, error.what());
    } catch (const Interrupted& stop) {
        out.end_progress();
        return fail(program.name, 130, fmt::format("interrupted: {}", stop.what()));
    } catch (const std::bad_alloc&) {
        return fail(program.name, 1, "out of memory");
    } catch (const std::exception& error) {
        out.end_progress();
        return fail(program.name, 1, error.what());
    }
    return flush_output(program.name);
}

}  // namespace nbd

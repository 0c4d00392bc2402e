#include "apps/cli/program.hpp"

#include <fmt/format.h>
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
#include <span>
#include <thread>

#include "apps/cli/interrupt.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/rank.hpp"
#include "collision/base/notice.hpp"
#include "collision/kernels/kernels.hpp"
#include "meshing/h5/version.hpp"
#include "meshing/progress/progress.hpp"
#include "sim/json/nearest_name.hpp"

namespace nbd {
namespace {

/// Prints an error as one line, even if a library's message has several, or a path has control characters.
int fail(std::string_view program, int status, std::string message) {
    std::ranges::replace_if(
        message, [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
    fmt::print(stderr, "{}: error: {}\n", program, message.substr(0, message.find_last_not_of(' ') + 1));
    return status;
}

std::vector<std::string> command_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands(nullptr)) names.push_back(command->get_name());
    return names;
}

/// Message that names an unknown command or its absence, and lists the known commands.
std::string unknown_command(const CLI::App& app) {
    const std::vector<std::string> rest = app.remaining(), names = command_names(app);
    return fmt::format("{}; known commands: {}",
                       rest.empty()
                           ? "no command"
                           : fmt::format("unknown command or option '{}'{}", rest.front(),
                                         nearest_hint(rest.front(), names, "; the nearest command is '{}'")),
                       fmt::join(names, ", "));
}

/// Message that names the first argument that a command did not expect.
std::string unexpected_argument(const CLI::App& app) {
    const CLI::App& command = *app.get_subcommands().front();
    std::vector<std::string> rest = command.remaining(), names;
    if (rest.empty()) rest = app.remaining();
    for (const CLI::App* of : {&command, &app})
        for (const CLI::Option* option : of->get_options())
            for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    const auto option =
        std::ranges::find_if(rest, [](const std::string& argument) { return argument.starts_with("--"); });
    if (option == rest.end())
        return fmt::format(
            "{}: too many arguments, the first that was not expected is '{}'; see {} {} --help",
            command.get_name(), rest.front(), app.get_name(), command.get_name());
    const std::string word = option->substr(0, option->find('='));
    return fmt::format("{}: unknown option '{}'{}; see {} {} --help", command.get_name(), word,
                       nearest_hint(word, names, "; the nearest known one is '{}'"), app.get_name(),
                       command.get_name());
}

/// Quotes an argument for a shell.
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

/// Refuses an empty argument, which is usually an unset variable in a script.
std::string not_empty(const std::string& text) { return text.empty() ? "must not be empty" : ""; }

/// Refuses whole numbers that CLI11 would read in another base: 010 and 0x10.
std::string decimal(const std::string& text) {
    const std::size_t digit = text.find_first_not_of("+-");
    const bool is_other = digit != text.npos && digit + 1 < text.size() && text[digit] == '0' &&
                          std::isalnum(static_cast<unsigned char>(text[digit + 1])) != 0;
    return is_other ? fmt::format("'{}' has a leading zero; allowed: a decimal number", text)
                    : not_empty(text);
}

bool takes_whole_numbers(const CLI::Option& option) {
    const std::string kind = option.get_type_name();
    return kind.starts_with("INT") || kind.starts_with("UINT");
}

bool accepts(CLI::Option& option, std::string text) {
    try {
        for (int i = 0;; ++i)
            if (!(*option.get_validator(i))(text).empty()) return false;
    } catch (const CLI::OptionNotFound&) {  // behind the last
        return true;
    }
}

/// Makes the options of a command refuse texts that none of their kind has, and --help show their defaults.
/// One that an option refuses, as a length of 0, says that it was not given, and is not shown.
void complete_options(CLI::App& command) {
    for (CLI::Option* option : command.get_options()) {
        if (option->get_expected_max() == 0) continue;
        option->check(takes_whole_numbers(*option) ? decimal : not_empty);
        option->capture_default_str();
        const std::string shown = option->get_default_str();
        if (shown.starts_with('[') ? shown == "[]" : !accepts(*option, shown)) option->default_str("");
    }
}

/// Makes queries use the kernels that the command line names.
void choose_kernels(const std::string& instructions) {
    const auto refuse = [&](const std::string& why) {
        throw CLI::ValidationError("--instructions", fmt::format("'{}'; {}", instructions, why));
    };
    std::vector<std::string> names;
    for (const InstructionSet set : instruction_sets) {
        names.emplace_back(name(set));
        if (instructions != name(set)) continue;
        const Kernels* form = kernels_for(set);
        if (!form) refuse("this CPU does not support these instructions");
        return use_kernels(*form);
    }
    refuse(fmt::format("allowed: plain, avx2, avx512 and neon{}",
                       nearest_hint(instructions, names, "; the nearest is {}")));
}

/// Says what to do instead of the first command or option that is gone; empty if there is none.
std::string gone_name(const Program& program, const CLI::App& app, std::span<char*> arguments) {
    const std::vector<std::string> commands = command_names(app);
    std::string command;
    for (const std::string argument : arguments) {
        const bool is_option = argument.starts_with("--");
        if (!is_option && !command.empty()) continue;
        const std::string name =
            is_option ? command + ' ' + argument.substr(0, argument.find('=')) : argument;
        if (const auto found = program.gone.find(name); found != program.gone.end())
            return fmt::format("`{} {}` is gone: {}", program.name, name, found->second);
        if (std::ranges::find(commands, argument) != commands.end()) command = argument;
    }
    return {};
}

/// Flushes standard output. Fails if it could not be written, for instance to a full disk.
int flush_output(std::string_view program) {
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return 0;
    return fail(program, 1, fmt::format("standard output: cannot write: {}", std::strerror(errno)));
}

const Output* running = nullptr;  // of the command that runs

/// Prints warnings of the libraries, each line only once.
void say_once(std::string_view line) {
    static std::mutex mutex;
    static std::set<std::string, std::less<>> said;
    const std::lock_guard lock(mutex);
    if (said.emplace(line).second) running->late_warning(line);
}

/// What programs of all names have. threads: set when the command line is parsed.
void add_common_options(CLI::App& app, Output& out, int& threads) {
    app.add_flag("-q,--quiet", out.quiet, "Print errors and warnings only, no progress and no tables");
    app.add_flag("--json", out.json,
                 "Print the result as one JSON object on standard output, with the warnings");
    app.add_flag("--strict", out.strict, "End at the first warning with status 1, and the warning as error");
    app.add_option("--threads", threads,
                   "Threads to use; 0: all cores, shared by mpirun's ranks. The result does not depend on it")
        ->check(whole_number(0, 1024));
    app.add_option_function<std::string>(
        "--instructions", choose_kernels,
        "Kernels of collision queries: plain, avx2, avx512 or neon; default: the best that the CPU supports. The "
        "result does not depend on it");
}

void add_examples(const Program& program, CLI::App& app) {
    for (const auto& [name, lines] : program.examples) {
        CLI::App* const command = app.get_subcommand(name);
        const std::string notes = command->get_footer();
        command->footer(fmt::format("{}{}Examples:\n{}", notes, notes.empty() ? "" : "\n\n", lines));
    }
}

int run(const Program& program, Output& out, int argc, char** argv) {
    CLI::App app(program.description, program.name);
    app.set_version_flag("--version", fmt::format("{} {}", program.name, build_version()));
    app.require_subcommand(1);
    app.fallthrough();  // global options may follow the command's own

    out.program = program.name;
    running = &out;
    set_notice_handler(say_once);
    set_progress_handler([&out](std::string_view what, double done, double total) {
        out.progress_of_work(what, done, total);
    });
    for (int i = 0; i < argc; ++i) out.command_line += (i == 0 ? "" : " ") + quoted(argv[i]);
    int threads = 0;
    add_common_options(app, out, threads);
    program.add_commands(app, out);
    add_examples(program, app);
    complete_options(app);
    for (CLI::App* command : app.get_subcommands(nullptr)) complete_options(*command);

    // Commands are final callbacks, which run after everything, including --threads, has been parsed.
    std::optional<tbb::global_control> limit;
    app.parse_complete_callback([&] {
        const unsigned mates = this_rank().on_this_machine;
        const std::size_t count = threads > 0 ? static_cast<std::size_t>(threads)
                                              : std::max(1u, std::thread::hardware_concurrency() / mates);
        limit.emplace(tbb::global_control::max_allowed_parallelism, count);
        catch_interrupts(program.name);
    });

    if (argc == 1 && !program.first_steps.empty()) {
        fmt::print(stderr, "{}", program.first_steps);
        return 2;
    }
    const std::span<char*> arguments(argv + 1, argv + argc);
    if (const std::string gone = gone_name(program, app, arguments); !gone.empty())
        return fail(program.name, 2, gone);
    try {
        // CLI11 wants them in reverse.
        app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::Success& request) {
        return app.exit(request);
    } catch (const CLI::RequiredError& error) {
        return fail(program.name, 2, app.get_subcommands().empty() ? unknown_command(app) : error.what());
    } catch (const CLI::ExtrasError& error) {
        return fail(program.name, 2, app.get_subcommands().empty() ? error.what() : unexpected_argument(app));
    } catch (const CLI::ParseError& error) {
        return fail(program.name, 2, error.what());
    } catch (const Interrupted& stop) {
        out.end_progress();
        return fail(program.name, 130, fmt::format("interrupted: {}", stop.what()));
    }
    out.end_progress();
    out.end_if_strict();
    return flush_output(program.name);
}

/// Name of the running file, for errors before a program has described itself.
std::string_view file_name(const char* path) {
    const std::string_view whole = path ? path : "";
    return whole.substr(whole.rfind('/') + 1);  // npos + 1 is 0
}

}  // namespace

int run_program(Program (*describe)(), int argc, char** argv) {
    Output out;
    try {
        return run(describe(), out, argc, argv);
    } catch (const std::bad_alloc&) {
        out.end_progress();
        return fail(file_name(argv[0]), 1, "out of memory");
    } catch (const std::exception& error) {
        out.end_progress();
        return fail(file_name(argv[0]), 1, error.what());
    }
}

}  // namespace nbd

#include "tests/apps/command.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <sstream>
#include <stdexcept>

#include "tests/support/file_damage.hpp"

namespace nbd::test {
namespace {

std::string temporary_file() {
    std::string name = (std::filesystem::temp_directory_path() / "nbd_command_XXXXXX").string();
    const int descriptor = mkstemp(name.data());
    if (descriptor < 0) throw std::runtime_error("no temporary file");
    close(descriptor);
    return name;
}

std::vector<std::string> divided(const std::string& text, char separator) {
    std::istringstream in(text);
    std::vector<std::string> parts;
    for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
    return parts;
}

}  // namespace

std::vector<std::string> words(std::string_view line) {
    std::vector<std::string> found;
    bool quoted = false, in_word = false;
    for (const char c : line) {
        if (c == '\'') quoted = !quoted;
        const bool divides = c == ' ' && !quoted;
        if (!divides && !in_word) found.emplace_back();
        if (!divides && c != '\'') found.back() += c;
        in_word = !divides;
    }
    return found;
}

std::vector<std::string> lines(const std::string& text) { return divided(text, '\n'); }
std::vector<std::string> cells(const std::string& line) { return divided(line, ','); }

void become(const std::filesystem::path& folder, std::string_view line, const char* program,
            const Environment& environment) {
    std::string called = std::filesystem::path(program).filename();
    std::vector<std::string> arguments = words(line);
    std::vector<char*> argv{called.data()};
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    // HDF5 1.10 leaks memory when it rejects a damaged file, and gmsh leaks at exit.
    setenv("ASAN_OPTIONS", "detect_leaks=0", 1);
    for (const auto& [name, value] : environment) setenv(name.c_str(), value.c_str(), 1);
    if (chdir(folder.c_str()) == 0) execv(program, argv.data());
    _exit(127);
}

Running::Running(const std::filesystem::path& folder, std::string_view line, const char* program, Start start,
                 const Environment& environment)
    : out_(temporary_file()), err_(temporary_file()) {
    process_ = fork();
    if (process_ < 0) throw std::runtime_error("cannot fork");
    if (process_ > 0) return;
    const int out = open(out_.c_str(), O_WRONLY), err = open(err_.c_str(), O_WRONLY);
    if (dup2(out, STDOUT_FILENO) < 0 || dup2(err, STDERR_FILENO) < 0) _exit(127);
    if (start == Start::interrupted) {  // blocked and pending signals outlive execv()
        sigset_t signals;
        sigemptyset(&signals);
        sigaddset(&signals, SIGINT);
        sigprocmask(SIG_BLOCK, &signals, nullptr);
        raise(SIGINT);
    }
    become(folder, line, program, environment);
}

Running::~Running() {
    if (process_ > 0) {
        kill();
        waitpid(process_, nullptr, 0);
    }
    unlink(out_.c_str());
    unlink(err_.c_str());
}

void Running::interrupt() const { ::kill(process_, SIGINT); }
void Running::kill() const { ::kill(process_, SIGKILL); }

bool Running::has_ended() const {
    siginfo_t info{};
    return waitid(P_PID, static_cast<id_t>(process_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == process_;
}

Ran Running::wait() {
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = -1;
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), read_bytes(out_), read_bytes(err_)};
}

Ran run(const std::filesystem::path& folder, std::string_view line, const Environment& environment) {
    return Running(folder, line, NBD_COMMAND, Running::Start::plain, environment).wait();
}

std::set<std::string> listing(const std::filesystem::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        names.insert(entry.path().filename());
    return names;
}

}  // namespace nbd::test

#include "apps/drawing/chart.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace nbd {
namespace {

namespace fs = std::filesystem;

fs::path draw_script() {
    std::error_code error;
    const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
    for (const fs::path& script : {folder / "draw.py", folder / "../share/nbdtree/draw.py"})
        if (fs::exists(script, error)) return script;
    throw std::runtime_error(
        fmt::format("{}: no such file; charts need this script of the project (apps/figures)",
                    (folder / "draw.py").string()));
}

struct Ended {
    int status = 0;     // of the script; 127 if there is no python3
    std::string error;  // what it printed on stderr
};

/// Runs the script by an interpreter and waits for its end.
Ended run_script(const std::string& python, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {python, draw_script().string()});
    std::vector<char*> words;
    for (std::string& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        throw std::runtime_error(fmt::format("cannot start python3: {}", std::strerror(errno)));
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, ends[1], 2);
    pid_t child = 0;
    const int failed = posix_spawnp(&child, python.c_str(), &actions, nullptr, words.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    Ended ended{.status = 127, .error = {}};
    if (failed == 0) {
        char buffer[4096];
        for (ssize_t count = 0; (count = read(ends[0], buffer, sizeof buffer)) != 0;) {
            if (count > 0) ended.error.append(buffer, count);
            if (count < 0 && errno != EINTR) break;
        }
        int status = 0;
        while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
        ended.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128;
    }
    close(ends[0]);
    return ended;
}

/// Throws the last line of what the script printed if it failed.
void check_end(const Ended& ended) {
    if (ended.status == 0) return;
    if (ended.status == 127)
        throw std::runtime_error("charts need python3 with matplotlib; install Debian's python3-matplotlib");
    std::string text = ended.error.substr(0, ended.error.find_last_not_of('\n') + 1);
    text = text.substr(text.rfind('\n') + 1);  // npos + 1 is 0
    if (text.starts_with("error: ")) text.erase(0, 7);
    throw std::runtime_error(text.empty() ? "draw.py was ended before the chart was drawn" : text);
}

/// The first interpreter that has matplotlib: the one on the PATH, or Debian's.
const std::string& python() {
    static const std::string chosen = [] {
        Ended ended;
        for (const char* candidate : {"python3", "/usr/bin/python3"})
            if (ended = run_script(candidate, {"--check"}); ended.status == 0) return std::string(candidate);
        check_end(ended);
        return std::string();
    }();
    return chosen;
}

}  // namespace

void check_charts() { python(); }

void draw_chart(const std::string& chart, const fs::path& table, const fs::path& picture,
                const std::vector<std::string>& more) {
    std::vector<std::string> arguments{chart, fs::absolute(table).string(), "-o",
                                       fs::absolute(picture).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    check_end(run_script(python(), std::move(arguments)));
}

}  // namespace nbd

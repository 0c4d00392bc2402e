#include "apps/drawing/chart.hpp"

#include <fmt/format.h>
#include <sys/wait.h>

#include <cstdio>
#include <stdexcept>

namespace nbd {
namespace {

namespace fs = std::filesystem;

fs::path draw_script() {
    std::error_code error;
    const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
    for (const fs::path& script : {folder / "draw_charts.py", folder / "../share/nbdtree/draw_charts.py"})
        if (fs::exists(script, error)) return script;
    throw std::runtime_error(
        fmt::format("{}: no such file; charts need this script of the project (apps/drawing)",
                    (folder / "draw_charts.py").string()));
}

/// A word for the shell.
std::string quoted(const std::string& word) {
    std::string text = "'";
    for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + '\'';
}

struct Ended {
    int status = 0;     // of the script; 127 if there is no such interpreter
    std::string error;  // what it printed on stderr
};

/// Runs the script by an interpreter and waits for its end.
Ended run_script(const std::string& python, const std::vector<std::string>& arguments) {
    std::string line = fmt::format("{} {}", python, quoted(draw_script().string()));
    for (const std::string& argument : arguments) line += ' ' + quoted(argument);
    FILE* pipe = popen((line + " 2>&1 >/dev/null </dev/null").c_str(), "re");
    if (!pipe) throw std::runtime_error("cannot start a shell, which draws charts");
    Ended ended;
    char buffer[4096];
    for (std::size_t n = 0; (n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;)
        ended.error.append(buffer, n);
    const int status = pclose(pipe);
    ended.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128;
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
    throw std::runtime_error(text.empty() ? "draw_charts.py was ended before the chart was drawn" : text);
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
    check_end(run_script(python(), arguments));
}

}  // namespace nbd

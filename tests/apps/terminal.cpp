#include "tests/apps/terminal.hpp"

#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <stdexcept>

namespace nbd::test {

TerminalRun::TerminalRun(const std::filesystem::path& folder, std::string_view line, int columns,
                         const char* kind, const Environment& environment) {
    std::string called = "nbdtree";
    std::vector<std::string> arguments = words(line);
    std::vector<char*> argv{called.data()};
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const winsize size{
        .ws_row = 24, .ws_col = static_cast<unsigned short>(columns), .ws_xpixel = 0, .ws_ypixel = 0};
    process_ = forkpty(&terminal_, nullptr, nullptr, &size);
    if (process_ < 0) throw std::runtime_error("cannot open a terminal");
    if (process_ > 0) return;
    termios settings{};
    tcgetattr(STDIN_FILENO, &settings);
    settings.c_lflag &= ~static_cast<tcflag_t>(ECHO);  // Ctrl-C shows nothing
    tcsetattr(STDIN_FILENO, TCSANOW, &settings);
    setenv("ASAN_OPTIONS", "detect_leaks=0", 1);
    setenv("TERM", kind, 1);
    for (const auto& [name, value] : environment) setenv(name.c_str(), value.c_str(), 1);
    if (chdir(folder.c_str()) == 0) execv(NBD_COMMAND, argv.data());
    _exit(127);
}

TerminalRun::~TerminalRun() {
    if (process_ > 0) {
        kill(process_, SIGKILL);
        waitpid(process_, nullptr, 0);
    }
    close(terminal_);
}

bool TerminalRun::read_some() {
    std::array<char, 4096> bytes;
    const ssize_t n = read(terminal_, bytes.data(), bytes.size());  // fails when the program has ended
    if (n > 0) printed_.append(bytes.data(), n);
    return n > 0;
}

bool TerminalRun::wait_for(const std::string& text) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(10);
    while (printed_.find(text) == std::string::npos) {
        pollfd waiting{terminal_, POLLIN, 0};
        if (std::chrono::steady_clock::now() > end || (poll(&waiting, 1, 1000) > 0 && !read_some()))
            return false;
    }
    return true;
}

void TerminalRun::press_ctrl_c() {
    constexpr char ctrl_c = 3;
    if (write(terminal_, &ctrl_c, 1) != 1) throw std::runtime_error("cannot write to the terminal");
}

int TerminalRun::wait() {
    while (read_some()) {
    }
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

}  // namespace nbd::test

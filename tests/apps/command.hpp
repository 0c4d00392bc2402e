#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace nbd::test {

/// How a run of the built `nbdtree` ended.
struct Ran {
    int status = 0;  // exit status; minus the number of the signal that killed it
    std::string out, err;
};

/// A run of `nbdtree`, or of another program of ours, in the background, in `folder`.
class Running {
 public:
    Running(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
            const char* program = NBD_COMMAND);
    ~Running();
    Running(const Running&) = delete;
    Running& operator=(const Running&) = delete;

    /// Returns once the program catches Ctrl-C; from then on it is at work.
    void wait_until_at_work() const;
    /// Ctrl-C.
    void interrupt() const;
    /// At once, with no chance to clean up.
    void kill() const;
    bool has_ended() const;
    Ran wait();

 private:
    bool catches_interrupts() const;

    std::string out_, err_;  // files
    int process_ = -1;
};

inline Ran run(const std::filesystem::path& folder, const std::vector<std::string>& arguments) {
    return Running(folder, arguments).wait();
}

/// The same of `nbdtree-bench`.
inline Ran run_bench(const std::filesystem::path& folder, const std::vector<std::string>& arguments) {
    return Running(folder, arguments, NBD_BENCH_COMMAND).wait();
}

/// Names of the files of a folder, hidden ones included.
std::set<std::string> listing(const std::filesystem::path& folder);

}  // namespace nbd::test

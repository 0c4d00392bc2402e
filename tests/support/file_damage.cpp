#include "tests/support/file_damage.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <random>

#include "tests/support/error_of.hpp"

namespace nbd::test {

std::size_t FileTest::files_in_folder() const {
    return std::distance(std::filesystem::directory_iterator(folder), {});
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    EXPECT_NE(at, text.npos) << from;
    return at == text.npos ? text : text.replace(at, from.size(), to);
}

std::string read_bytes(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary).write(bytes.data(), bytes.size());
}

void expect_clear(const std::string& error, const std::filesystem::path& path) {
    EXPECT_EQ(error.find(path.string() + ": "), 0u) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    EXPECT_LT(error.size(), 400u) << error;
}

void expect_damage_is_found(const std::filesystem::path& file,
                            const std::function<std::string(const std::filesystem::path&)>& load, int cuts,
                            int flips) {
    const std::string bytes = read_bytes(file), whole = load(file);
    const std::filesystem::path damaged = file.parent_path() / "damaged.h5";
    std::mt19937_64 random(7);
    const auto place = [&] { return random() % bytes.size(); };
    const auto check = [&](const std::string& content, const std::string& what) {
        write_bytes(damaged, content);
        std::string result;
        const std::string error = error_of([&] { result = load(damaged); });
        if (error.empty())
            EXPECT_TRUE(result == whole) << what << " gave other content";
        else
            expect_clear(error, damaged);
        return !error.empty();
    };
    for (int i = 0; i < cuts; ++i) {
        const std::size_t size = place();
        EXPECT_TRUE(check(bytes.substr(0, size), "cut at " + std::to_string(size))) << size;
    }
    int found = 0;
    for (int i = 0; i < flips; ++i) {
        const std::size_t at = place();
        std::string content = bytes;
        content[at] = static_cast<char>(content[at] ^ static_cast<char>(1 + random() % 255));
        found += check(content, "byte " + std::to_string(at));
    }
    EXPECT_GT(found, flips / 2);  // the other changes hit unused bytes
}

int in_child(const std::function<void()>& action) {
    const pid_t child = fork();
    if (child == 0) {
        action();
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

void limit_file_size(std::size_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{bytes, RLIM_INFINITY};
    setrlimit(RLIMIT_FSIZE, &limit);
}

}  // namespace nbd::test

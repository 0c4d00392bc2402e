#include "apps/cli/available_memory.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

namespace nbd {
namespace {

constexpr std::uint64_t unlimited = std::numeric_limits<std::uint64_t>::max();

std::uint64_t of_meminfo() {
    std::ifstream file("/proc/meminfo");
    std::string name, unit;
    for (std::uint64_t kib = 0; file >> name >> kib && std::getline(file, unit);)
        if (name == "MemAvailable:") return kib * 1024;
    return unlimited;
}

/// The number in a file; unlimited for "max" and for a file that is not there.
std::uint64_t limit_in(const std::filesystem::path& path) {
    std::ifstream file(path);
    std::uint64_t bytes = 0;
    return file >> bytes ? bytes : unlimited;
}

/// The least limit of the process's control group and of those above it, in version 1 or 2.
std::uint64_t of_control_groups() {
    std::uint64_t least = unlimited;
    std::ifstream groups("/proc/self/cgroup");  // lines such as "0::/a/b" and "9:memory:/a/b"
    for (std::string line; std::getline(groups, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == line.npos) continue;
        const std::string controllers = line.substr(first + 1, second - first - 1);
        if (!controllers.empty() && controllers != "memory") continue;
        const std::filesystem::path root = controllers.empty() ? "/sys/fs/cgroup" : "/sys/fs/cgroup/memory";
        const char* file = controllers.empty() ? "memory.max" : "memory.limit_in_bytes";
        for (std::filesystem::path group = line.substr(second + 1);; group = group.parent_path()) {
            least = std::min(least, limit_in(root / group.relative_path() / file));
            if (!group.has_relative_path()) break;
        }
    }
    return least;
}

}  // namespace

std::uint64_t available_memory() { return std::min(of_meminfo(), of_control_groups()); }

}  // namespace nbd

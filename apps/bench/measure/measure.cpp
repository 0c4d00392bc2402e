#include "apps/bench/measure/measure.hpp"

#include <fmt/format.h>
#include <malloc.h>

#include <ctime>
#include <fstream>
#include <thread>

#include "collision/kernels/kernels.hpp"

namespace nbd {
namespace {

/// The value in the first line of /proc/cpuinfo that begins with the key.
std::string of_processor(const std::string& key) {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with(key)) {
            const std::size_t colon = line.find(": ");
            return colon == std::string::npos ? std::string() : line.substr(colon + 2);
        }
    return {};
}

/// Size of a cache of the first core, as the system reports it.
std::string cache(int index) {
    std::ifstream file(fmt::format("/sys/devices/system/cpu/cpu0/cache/index{}/size", index));
    std::string size;
    file >> size;
    return size;
}

}  // namespace

std::string this_machine() {
    std::string text = of_processor("model name");
    if (text.empty()) text = "unknown processor";
    text += fmt::format(", {} kernels", name(kernels().instructions));
    text += fmt::format(", {} cores", std::thread::hardware_concurrency());
    if (const std::string l2 = cache(2), l3 = cache(3); !l2.empty() && !l3.empty())
        text += fmt::format(", caches of {} and {}", l2, l3);
#ifdef __VERSION__
    text += ", compiler " __VERSION__;
#endif
    return text;
}

std::size_t heap_bytes() {
#if defined(__GLIBC__) && (__GLIBC__ > 2 || __GLIBC_MINOR__ >= 33)
    const struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
#else
    return 0;
#endif
}

double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace nbd

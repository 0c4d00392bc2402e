#include "apps/cli/test_points.hpp"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "apps/cli/interrupt.hpp"

namespace nbd {
namespace {

struct TestPoint {
    std::string name;
    double done = 0;
    std::string action, file;
    std::atomic<bool> passed = false;
};

std::vector<std::string> split(const std::string& text, char separator) {
    std::vector<std::string> parts;
    std::istringstream stream(text);
    for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
    return parts;
}

std::deque<TestPoint> read_test_points() {
    std::deque<TestPoint> points;
    const char* const text = std::getenv("NBDTREE_AT");
    if (!text) return points;
    for (const std::string& entry : split(text, ';')) {
        const std::vector<std::string> parts = split(entry, '|');
        const bool waits = parts.size() == 4 && parts[2] == "wait",
                   signals = parts.size() == 3 && (parts[2] == "interrupt" || parts[2] == "kill");
        if (!waits && !signals)
            throw std::invalid_argument(fmt::format(
                "NBDTREE_AT: is '{}'; allowed: NAME|DONE|interrupt, NAME|DONE|kill or NAME|DONE|wait|FILE",
                entry));
        TestPoint& point = points.emplace_back();
        point.name = parts[0];
        point.done = std::strtod(parts[1].c_str(), nullptr);
        point.action = parts[2];
        if (waits) point.file = parts[3];
    }
    return points;
}

void act(const TestPoint& point) {
    if (point.action == "interrupt") std::raise(SIGINT);
    if (point.action == "kill") std::raise(SIGKILL);
    if (point.action != "wait") return;
    std::ofstream(point.file + ".waits").flush();
    while (!std::filesystem::exists(point.file) && !interrupted())
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
}

}  // namespace

void pass_test_point(std::string_view name, double done) {
    static std::deque<TestPoint> points = read_test_points();
    for (TestPoint& point : points)
        if (point.name == name && done >= point.done && !point.passed.exchange(true)) act(point);
}

}  // namespace nbd

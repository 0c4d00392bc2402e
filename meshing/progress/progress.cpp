#include "meshing/progress/progress.hpp"

#include <mutex>
#include <utility>

namespace nbd {
namespace {

ProgressHandler& listener() {
    static ProgressHandler handler;
    return handler;
}

}  // namespace

void set_progress_handler(ProgressHandler handler) { listener() = std::move(handler); }

void tell_progress(std::string_view what, double done, double total) {
    static std::mutex telling;
    if (!listener()) return;
    std::unique_lock lock(telling, std::defer_lock);
    if (done == total)
        lock.lock();
    else if (!lock.try_lock())
        return;
    listener()(what, done, total);
}

}  // namespace nbd

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
    if (const std::unique_lock lock(telling, std::try_to_lock); lock) listener()(what, done, total);
}

}  // namespace nbd

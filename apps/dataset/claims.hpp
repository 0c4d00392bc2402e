#pragma once

#include <filesystem>
#include <functional>
#include <memory>

namespace nbd {

/// Distributes work among processes that share a folder, on one machine or several: one process at a time
/// holds the claim to an item. A claim is a lock on one byte of a file. The system releases it when the
/// process ends, however it ends, so claims never become stale. Does not separate threads of one process.
class Claims {
 public:
    /// Creates the file if it is missing. Throws std::runtime_error with path and reason.
    explicit Claims(const std::filesystem::path& file);
    ~Claims();
    Claims(const Claims&) = delete;
    Claims& operator=(const Claims&) = delete;

    /// Ends a claim.
    struct Release {
        long item;
        void operator()(const Claims* claims) const;
    };
    /// A claim, held until destruction. Null if another process holds it.
    using Held = std::unique_ptr<const Claims, Release>;

    /// Claims an item, >= 0, if it is free. On a file system without locks every claim is granted; work may
    /// then be done twice, with the same result. Throws std::runtime_error with path and reason.
    Held try_claim(long item) const;

    /// Waits for the claim. Calls `idle` now and then, which may throw to stop waiting.
    Held wait_for(long item, const std::function<void()>& idle) const;

 private:
    bool lock(long item, short kind) const;

    std::filesystem::path file_;
    int descriptor_;
};

}  // namespace nbd

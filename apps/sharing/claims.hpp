#pragma once

#include <filesystem>
#include <functional>

namespace nbd {

/// Deals work out among processes that share a folder: of all of them, on one machine or many, one at a time
/// holds the claim to an item. A claim is a lock on one byte of a file, which the system takes back when the
/// process ends, however it ends: nothing goes stale. Not among the threads of one process.
class Claims {
 public:
    /// Makes the file where it is missing. Throws std::runtime_error with path and reason.
    explicit Claims(const std::filesystem::path& file);
    ~Claims();
    Claims(const Claims&) = delete;
    Claims& operator=(const Claims&) = delete;

    /// A claim until its end. False: another process holds it.
    class Held {
     public:
        Held(const Claims* claims, long item) noexcept : claims_(claims), item_(item) {}
        ~Held();
        Held(Held&& other) noexcept;
        Held& operator=(Held&&) = delete;
        explicit operator bool() const noexcept { return claims_ != nullptr; }

     private:
        const Claims* claims_;
        long item_;
    };

    /// item: >= 0. Where the file system has no locks, every claim is granted: work may then be done twice,
    /// to the same result. Throws std::runtime_error with path and reason.
    Held try_claim(long item) const;

    /// Waits for the claim. `idle` is called now and then meanwhile and may throw to end the waiting.
    Held wait_for(long item, const std::function<void()>& idle) const;

 private:
    bool lock(long item, short kind) const;

    std::filesystem::path file_;
    int descriptor_;
};

}  // namespace nbd

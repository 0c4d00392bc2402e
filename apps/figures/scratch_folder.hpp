#pragma once

#include <filesystem>

namespace nbd {

/// A new, empty folder for files that nobody is to see, removed with all that it holds.
class ScratchFolder {
 public:
    /// Throws std::runtime_error with path and reason.
    ScratchFolder();
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    const std::filesystem::path& path() const noexcept { return path_; }

 private:
    std::filesystem::path path_;
};

}  // namespace nbd

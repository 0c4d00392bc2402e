#pragma once

#include <filesystem>

namespace nbd::h5 {

/// A file that does not stand under its name yet: a fresh, empty, hidden file in the same folder, unique to
/// this object, which commit() moves to `path` in one step. Readers see the old file or the whole new one,
/// never a part; of two writers to one name, the later commit stays. The destructor removes what was not
/// committed.
class TemporaryFile {
 public:
    /// Throws std::runtime_error with path and reason where `path` is a folder or its folder is missing or
    /// not writable.
    explicit TemporaryFile(std::filesystem::path path);
    ~TemporaryFile();
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;

    /// Open for reading and writing.
    int descriptor() const noexcept { return descriptor_; }
    /// The name that commit() gives.
    const std::filesystem::path& path() const noexcept { return path_; }

    /// Brings the bytes to the disk, renames, brings the folder to the disk. Call once, after the last
    /// write. Throws std::runtime_error with path and reason; the file under `path` is then the old one.
    void commit();

 private:
    std::filesystem::path path_, temporary_;
    int descriptor_ = -1;
    int slot_ = -1;
};

/// Removes the temporary files that killed processes of this machine left of files whose names begin as that
/// of `path`, in its folder. Nobody else may be writing such files.
void remove_abandoned(const std::filesystem::path& path) noexcept;

/// Removes the temporary files of all live TemporaryFile objects. Async-signal-safe, for a handler that
/// then ends the process.
void remove_temporaries() noexcept;

}  // namespace nbd::h5

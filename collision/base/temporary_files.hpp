#pragma once

#include <filesystem>
#include <span>
#include <string_view>

namespace nbd {

/// A file under construction: a new, empty, hidden file in the target folder, unique to this object. commit()
/// moves it to `path` in one step. Readers see either the old file or the complete new one; of two writers to
/// one name, the later commit wins. The destructor removes an uncommitted file.
class TemporaryFile {
 public:
    /// Throws std::runtime_error with path and reason if `path` is a folder, or if its folder is missing or
    /// not writable.
    explicit TemporaryFile(std::filesystem::path path);
    ~TemporaryFile();
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;

    /// Open for reading and writing.
    int descriptor() const noexcept { return descriptor_; }
    /// The final name, given by commit().
    const std::filesystem::path& path() const noexcept { return path_; }

    /// Appends bytes. Returns whether all were written; commit() reports why not.
    bool write(std::span<const char> bytes) noexcept;

    /// Flushes the file to disk, renames it and flushes the folder. Call once, after the last write. Throws
    /// std::runtime_error with path and reason, also of a failed write(); the old file then stays under
    /// `path`.
    void commit();

 private:
    std::filesystem::path path_, temporary_;
    int descriptor_ = -1;
    int error_ = 0;  // of the first write that failed
    int slot_ = -1;
};

/// Removes temporary files that killed processes of this machine left in the folder of `path` for names that
/// begin with its file name. A folder that cannot be read is left as it is.
void remove_abandoned(const std::filesystem::path& path);

/// Removes the temporary files of all live TemporaryFile objects. Async-signal-safe, for a handler that then
/// ends the process.
void remove_temporaries() noexcept;

/// The final names of the files that this process has written so far, "a.csv, b.csv", in at most 4 kB.
/// Async-signal-safe.
std::string_view written_files() noexcept;

}  // namespace nbd

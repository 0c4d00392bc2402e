#pragma once

#include <filesystem>
#include <memory>
#include <ostream>

namespace nbd::h5 {

/// A text file (CSV, OBJ, VTU, JSON) that appears under its name complete or not at all; see TemporaryFile.
///     AtomicFile file("table.csv");
///     file.out() << "node,radius\n";
///     file.commit();
class AtomicFile {
 public:
    /// Throws std::runtime_error with path and reason if the file cannot be created.
    explicit AtomicFile(const std::filesystem::path& path);
    ~AtomicFile();
    AtomicFile(AtomicFile&&) noexcept;

    /// Stream in the "C" locale; doubles have 17 digits, so they read back exactly. commit() reports a failed
    /// write.
    std::ostream& out() noexcept;

    /// Flushes the file and moves it to its final name. Call once. Throws std::runtime_error with path and
    /// reason if any write failed.
    void commit();

 private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

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

}  // namespace nbd::h5

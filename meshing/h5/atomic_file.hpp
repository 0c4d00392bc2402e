#pragma once

#include <filesystem>
#include <memory>
#include <ostream>

namespace nbd::h5 {

/// A text file (CSV, OBJ, VTU, JSON) that appears under its name whole or not at all; see TemporaryFile.
///     AtomicFile file("table.csv");
///     file.out() << "node,radius\n";
///     file.commit();
class AtomicFile {
 public:
    /// Throws std::runtime_error with path and reason.
    explicit AtomicFile(const std::filesystem::path& path);
    ~AtomicFile();
    AtomicFile(AtomicFile&&) noexcept;

    /// Formats in the "C" locale, doubles with 17 digits: what is read back is what was written. A write
    /// that fails is reported by commit().
    std::ostream& out() noexcept;

    /// Flushes and moves the file to its name. Call once. Throws std::runtime_error with path and reason
    /// where any write failed.
    void commit();

 private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace nbd::h5

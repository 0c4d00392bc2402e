#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace nbd {

/// An append-only file of records from which a run that was killed continues. Every record is checksummed and
/// on the disk when append() returns; a record that is not whole, and what follows it, never counts. The file
/// is locked while the object lives, where the file system knows locks, so that one run at a time writes it;
/// the lock ends with the process.
class Journal {
 public:
    /// What a run was begun with: names and values, each without line breaks, in an order of their own.
    using Facts = std::vector<std::pair<std::string, std::string>>;

    /// Opens the journal at `path`, or begins one. resume: whether records of an earlier run may be there.
    /// Throws std::runtime_error, one line with the path: another run holds the lock; records are there but
    /// `resume` is false; they were begun with other facts (the first that differs is named); the file is no
    /// journal; the disk refuses.
    Journal(std::filesystem::path path, const Facts& facts, bool resume);
    /// Removes a journal without records.
    ~Journal();
    Journal(const Journal&) = delete;
    Journal& operator=(const Journal&) = delete;

    /// The next record of the earlier run, nothing after the last whole one.
    std::optional<std::string> next();

    /// Adds a record; next() must have returned nothing before. Throws std::runtime_error with path and
    /// reason.
    void append(std::string_view record);

    /// Deletes the file: the run is complete.
    void remove();

    const std::filesystem::path& path() const noexcept { return path_; }

 private:
    void lock();
    void write_at_end(std::string_view bytes);
    std::optional<std::string> read_record();
    [[noreturn]] void fail(const std::string& what) const;

    std::filesystem::path path_;
    int descriptor_ = -1;
    std::uint64_t position_ = 0;  // end of the last record read or written
    int records_ = 0;             // read or written
};

}  // namespace nbd

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace nbd {

/// Append-only file of records, from which a killed run continues. Every record is checksummed, and on disk
/// when append() returns. An incomplete record and everything after it are ignored. The file is locked while
/// the object lives, if the file system supports locks, so that only one run writes it; the lock ends with
/// the process.
class Journal {
 public:
    /// Settings that a run was started with: ordered names and values without line breaks.
    using Facts = std::vector<std::pair<std::string, std::string>>;

    /// Opens or creates the journal at `path`. resume: whether it may contain records of an earlier run.
    /// Throws std::runtime_error, one line with the path, if another run holds the lock; there are records
    /// but `resume` is false; their run was started with other facts (names the first that differs); the file
    /// is not a journal; or it cannot be read or written.
    Journal(std::filesystem::path path, const Facts& facts, bool resume);
    /// Removes a journal without records.
    ~Journal();
    Journal(const Journal&) = delete;
    Journal& operator=(const Journal&) = delete;

    /// The next record of the earlier run; nullopt after the last complete one.
    std::optional<std::string> next();

    /// Appends a record; next() must have returned nullopt before. Throws std::runtime_error with path and
    /// reason.
    void append(std::string_view record);

    /// Deletes the file. Call when the run is complete.
    void remove();

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

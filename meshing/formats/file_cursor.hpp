#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace nbd {

/// Reads words and numbers in sequence from a file held in memory; numbers may be text or binary. Every read
/// ends in a value or in a one-line std::runtime_error with path, place and reason, whatever the bytes are.
class FileCursor {
 public:
    /// Throws std::runtime_error if the file cannot be read.
    explicit FileCursor(const std::filesystem::path& path);

    /// Switches numbers to raw bytes (in reversed order if `swapped`) or back to text.
    void read_binary(bool swapped) noexcept { binary_ = true, swapped_ = swapped; }
    void read_text() noexcept { binary_ = false; }

    /// Skips white space. Returns true at the end of the file.
    bool at_end() noexcept;
    /// Number of bytes behind the cursor.
    std::size_t bytes_left() const noexcept { return bytes_.size() - at_; }
    /// The next word; the rest of the current line, moving past its end.
    std::string_view word();
    std::string_view line();
    /// As line(), but nothing at the end of the file.
    void rest_of_line() noexcept;
    /// Moves past raw bytes. Fails if the file has fewer.
    void skip(std::uint64_t bytes);
    /// True if the text at the cursor starts with `text`. Does not move the cursor.
    bool is_next(std::string_view text) const noexcept;
    /// Throws unless the next word is `text`.
    void expect(std::string_view text);
    /// Moves past the next occurrence of `text`.
    void skip_past(std::string_view text);

    /// True at the end of the line, past spaces, and at the end of the file.
    bool at_line_end() noexcept;
    /// Makes spaces of each `mark` and what follows it in its line.
    void blank_comments(char mark) noexcept;

    /// The next number, as text or as raw bytes. T: an integer of up to 8 bytes, float or double.
    template <class T>
    T number();
    int int32() { return number<std::int32_t>(); }
    std::int64_t int64() { return number<std::int64_t>(); }
    float real32() { return number<float>(); }
    double real64() { return number<double>(); }
    /// Reads a count from text or a raw int64. Fails unless it is >= 0 and the rest of the file can hold that
    /// many items of `least_bytes` each, so a damaged count never allocates memory.
    std::size_t count(std::string_view things, std::size_t least_bytes);
    /// Makes the same check for a count that has been read already.
    std::size_t check_count(std::int64_t n, std::string_view things, std::size_t least_bytes) const;

    /// All bytes of the file, and a move to one of them.
    std::string_view bytes() const noexcept { return bytes_; }
    void move_to(std::size_t byte) noexcept { at_ = std::min(byte, bytes_.size()); }

    /// Throws std::runtime_error: "path, line 12: reason".
    [[noreturn]] void fail(const std::string& reason) const;

 private:
    std::filesystem::path path_;
    std::string bytes_;
    std::size_t at_ = 0;
    bool binary_ = false, swapped_ = false;
};

}  // namespace nbd

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace nbd {

/// Reads words and numbers one after another from a file held in memory, numbers as text or in binary.
/// Whatever the bytes are, the end is either a value or a std::runtime_error of one line: path, place,
/// reason.
class FileCursor {
 public:
    /// Throws std::runtime_error if the file cannot be read.
    explicit FileCursor(const std::filesystem::path& path);

    /// From now on numbers are raw bytes, their order reversed if `swapped`; or text again.
    void read_binary(bool swapped) noexcept { binary_ = true, swapped_ = swapped; }
    void read_text() noexcept { binary_ = false; }

    /// Skips white space; true if nothing follows.
    bool at_end() noexcept;
    /// The next word, or the rest of the current line with the cursor moved past it.
    std::string_view word();
    std::string_view line();
    /// True if `text` stands at the cursor, which stays.
    bool is_next(std::string_view text) const noexcept;
    /// Throws unless the next word is `text`.
    void expect(std::string_view text);
    /// Moves past the next occurrence of `text`.
    void skip_past(std::string_view text);

    /// The next number: text, or raw of the width in the name.
    int int32();
    std::int64_t int64();
    float real32();
    double real64();
    /// A number of things from text or raw int64, refused unless it is >= 0 and as many of `least_bytes` each
    /// still fit in the file, so that a damaged count never allocates.
    std::size_t count(std::string_view things, std::size_t least_bytes);
    /// The same check for a number that is already read.
    std::size_t check_count(std::int64_t n, std::string_view things, std::size_t least_bytes) const;

    /// Throws std::runtime_error: "path, line 12: reason".
    [[noreturn]] void fail(const std::string& reason) const;

 private:
    template <class T>
    T number();

    std::filesystem::path path_;
    std::string bytes_;
    std::size_t at_ = 0;
    bool binary_ = false, swapped_ = false;
};

}  // namespace nbd

#include "meshing/formats/file_cursor.hpp"

#include <fmt/format.h>

#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>

#include "collision/base/file_text.hpp"
#include "meshing/formats/words.hpp"

namespace nbd {
namespace {

constexpr std::string_view white = " \t\r\n\v\f";

/// A word of the file for a message.
std::string quoted(std::string_view word) { return fmt::format("'{}'", printable(word)); }

}  // namespace

FileCursor::FileCursor(const std::filesystem::path& path) : path_(path), bytes_(file_text(path)) {}

bool FileCursor::at_end() noexcept {
    at_ = std::min(bytes_.find_first_not_of(white, at_), bytes_.size());
    return at_ == bytes_.size();
}

std::string_view FileCursor::word() {
    if (at_end()) fail("the file ends early");
    const std::size_t begin = at_;
    at_ = std::min(bytes_.find_first_of(white, at_), bytes_.size());
    return std::string_view(bytes_).substr(begin, at_ - begin);
}

std::string_view FileCursor::line() {
    if (at_ == bytes_.size()) fail("the file ends early");
    const std::size_t begin = at_, end = std::min(bytes_.find('\n', at_), bytes_.size());
    at_ = std::min(end + 1, bytes_.size());
    std::string_view text = std::string_view(bytes_).substr(begin, end - begin);
    if (text.ends_with('\r')) text.remove_suffix(1);
    return text;
}

void FileCursor::rest_of_line() noexcept { at_ = std::min(bytes_.find('\n', at_), bytes_.size() - 1) + 1; }

bool FileCursor::at_line_end() noexcept {
    at_ = std::min(bytes_.find_first_not_of(" \t\r\v\f", at_), bytes_.size());
    return at_ == bytes_.size() || bytes_[at_] == '\n';
}

void FileCursor::blank_comments(char mark) noexcept {
    for (std::size_t at = bytes_.find(mark); at < bytes_.size(); at = bytes_.find(mark, at)) {
        const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(at);
        std::fill(begin, std::find(begin, bytes_.end(), '\n'), ' ');
    }
}

void FileCursor::skip(std::uint64_t bytes) {
    if (bytes_.size() - at_ < bytes) fail("the file ends early");
    at_ += bytes;
}

bool FileCursor::is_next(std::string_view text) const noexcept {
    return std::string_view(bytes_).substr(at_).starts_with(text);
}

void FileCursor::expect(std::string_view text) {
    if (const std::string_view found = word(); found != text)
        fail(fmt::format("expected {}, found {}", text, quoted(found)));
}

void FileCursor::skip_past(std::string_view text) {
    const std::size_t found = bytes_.find(text, at_);
    if (found == std::string::npos) fail(fmt::format("the file ends early, without {}", text));
    at_ = found + text.size();
}

template <class T>
T FileCursor::number() {
    if (binary_) {
        T value{};
        if (bytes_.size() - at_ < sizeof(T)) fail("the file ends early");
        char raw[sizeof(T)];
        std::memcpy(raw, bytes_.data() + at_, sizeof(T));
        if (swapped_) std::reverse(std::begin(raw), std::end(raw));
        std::memcpy(&value, raw, sizeof(T));
        at_ += sizeof(T);
        return value;
    }
    const std::string_view text = word();
    const std::optional<T> number = number_in<T>(text);
    if (!number)
        fail(fmt::format("expected {}, found {}",
                         std::numeric_limits<T>::is_integer ? "an integer" : "a number", quoted(text)));
    if (is_too_large(text, *number)) fail(fmt::format("{} is too large", quoted(text)));
    return *number;
}

template std::int8_t FileCursor::number();
template std::uint8_t FileCursor::number();
template std::int16_t FileCursor::number();
template std::uint16_t FileCursor::number();
template std::int32_t FileCursor::number();
template std::uint32_t FileCursor::number();
template std::int64_t FileCursor::number();
template float FileCursor::number();
template double FileCursor::number();

std::size_t FileCursor::check_count(std::int64_t n, std::string_view things, std::size_t least_bytes) const {
    const auto fitting =
        std::min<std::size_t>((bytes_.size() - at_) / least_bytes, std::numeric_limits<int>::max());
    if (n < 0 || static_cast<std::uint64_t>(n) > fitting + 1)
        fail(fmt::format("claims {} {}, but the rest of the file holds at most {}", n, things, fitting + 1));
    return n;
}

std::size_t FileCursor::count(std::string_view things, std::size_t least_bytes) {
    return check_count(int64(), things, least_bytes);
}

void FileCursor::fail(const std::string& reason) const {
    if (binary_) throw std::runtime_error(fmt::format("{}, byte {}: {}", path_.string(), at_, reason));
    const auto lines = std::count(bytes_.begin(), bytes_.begin() + at_, '\n');
    throw std::runtime_error(fmt::format("{}, line {}: {}", path_.string(), lines + 1, reason));
}

}  // namespace nbd

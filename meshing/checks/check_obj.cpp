#include "meshing/checks/check_obj.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "meshing/checks/printable.hpp"

namespace nbd {
namespace {

constexpr std::string_view white = " \t\v\f";

/// Takes the next word of a line; empty at its end.
std::string_view take_word(std::string_view& line) {
    line.remove_prefix(std::min(line.find_first_not_of(white), line.size()));
    const std::string_view word = line.substr(0, line.find_first_of(white));
    line.remove_prefix(word.size());
    return word;
}

/// The number may have a decimal comma.
bool is_number(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto is_all = [](std::string_view text) {
        double value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        return error != std::errc::invalid_argument && end == text.data() + text.size();
    };
    if (is_all(word)) return true;
    std::string with_point(word);
    std::ranges::replace(with_point, ',', '.');
    return with_point != word && is_all(with_point);
}

/// Index of the vertex in a corner such as 3, 3/1 or -1//2; empty if it is no whole number.
std::optional<std::int64_t> vertex_index(std::string_view corner) {
    corner = corner.substr(0, corner.find('/'));
    if (corner.starts_with('+')) corner.remove_prefix(1);
    std::int64_t index = 0;
    const auto [end, error] = std::from_chars(corner.data(), corner.data() + corner.size(), index);
    if (error != std::errc() || end != corner.data() + corner.size()) return std::nullopt;
    return index;
}

/// Follows the lines of a file.
class ObjCheck {
 public:
    /// Carriage returns end lines, too. After a backslash at its end a line goes on, even a comment.
    void line(std::string_view text) {
        bool belongs_to_last = std::exchange(goes_on_, false);
        if (text.ends_with('\r')) text.remove_suffix(1);
        for (;;) {
            ++number_;
            const std::size_t end = text.find('\r');
            const std::string_view part = text.substr(0, end);
            goes_on_ = part.ends_with('\\');
            if (!std::exchange(belongs_to_last, false)) statement(part);
            if (goes_on_ || end == text.npos) return;
            text.remove_prefix(end + 1);
        }
    }

    /// Checks the faces that came before their vertices.
    void end() const {
        if (farthest_ > vertices_)
            fail(farthest_line_, fmt::format("the face refers to vertex {}, but the file has {} vertices",
                                             farthest_, vertices_));
    }

 private:
    [[noreturn]] static void fail(std::int64_t number, const std::string& what) {
        throw std::runtime_error(fmt::format("line {}: {}", number, what));
    }

    void statement(std::string_view text) {
        if (text.size() < 2 || (text[0] != 'v' && text[0] != 'f') || white.find(text[1]) == white.npos)
            return;
        const bool is_vertex = text[0] == 'v';
        vertices_ += is_vertex;
        text.remove_prefix(1);
        if (goes_on_) return;
        is_vertex ? check_vertex(text.substr(0, text.find('#'))) : check_face(text);
    }

    void check_vertex(std::string_view text) const {
        int count = 0;
        for (std::string_view word = take_word(text); !word.empty(); word = take_word(text), ++count)
            if (!is_number(word))
                fail(number_, fmt::format("the vertex has '{}'; allowed: numbers", printable(word)));
        if (count != 3 && count != 4 && count != 6)
            fail(number_, fmt::format("the vertex has {} number{}; allowed: 3, 4 with a weight, or 6 with a "
                                      "colour",
                                      count, count == 1 ? "" : "s"));
    }

    void check_face(std::string_view text) {
        for (std::string_view word = take_word(text); !word.empty(); word = take_word(text)) {
            const std::optional<std::int64_t> index = vertex_index(word);
            if (!index)
                fail(number_, fmt::format("the face has '{}'; allowed: corners such as 3, 3/1 or 3/1/2",
                                          printable(word)));
            if (*index == 0)
                fail(number_, "the face refers to vertex 0; allowed: from 1 on, or from -1 back");
            if (*index < -vertices_)
                fail(number_, fmt::format("the face refers to vertex {}, but {} vertices come before it",
                                          *index, vertices_));
            if (*index > farthest_) {
                farthest_ = *index;
                farthest_line_ = number_;
            }
        }
    }

    std::int64_t number_ = 0, vertices_ = 0;
    bool goes_on_ = false;                           // the line that was read last, in the next one
    std::int64_t farthest_ = 0, farthest_line_ = 0;  // the largest index of a face, and where it is
};

}  // namespace

void check_obj(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    ObjCheck check;
    std::string line;
    while (std::getline(file, line)) check.line(line);
    check.end();
}

}  // namespace nbd

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "meshing/formats/surface_formats.hpp"
#include "meshing/formats/words.hpp"

namespace nbd {
namespace {

/// Word by word reader of a file's non-empty lines, without comments.
class Lines {
 public:
    explicit Lines(const std::filesystem::path& path) : file_(path) {}

    /// Moves to the next such line. `item` names what was expected, for the error message at the end of the
    /// file.
    void next(const std::string& item) {
        item_ = item;
        do {
            if (!std::getline(file_, line_))
                throw std::runtime_error("OFF: the file ends early, before " + item);
            rest_ = std::string_view(line_).substr(0, line_.find('#'));
        } while (is_over());
    }

    /// Whether the current line has no more words.
    bool is_over() {
        rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\v\f"), rest_.size()));
        return rest_.empty();
    }

    /// The next word of the item, on the next line where the current one is over.
    std::string_view wrapped_word() {
        while (is_over()) {
            if (!std::getline(file_, line_))
                throw std::runtime_error(fmt::format("OFF: {} ends early", item_));
            rest_ = std::string_view(line_).substr(0, line_.find('#'));
        }
        return word();
    }

    std::string_view word() {
        if (is_over()) throw std::runtime_error(fmt::format("OFF: {} ends early", item_));
        const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\v\f"));
        rest_.remove_prefix(word.size());
        return word;
    }

    template <class T>
    T number() {
        return number<T>(word());
    }
    template <class T>
    T wrapped_number() {
        return number<T>(wrapped_word());
    }

 private:
    template <class T>
    T number(std::string_view text) {
        const auto value = number_in<T>(text);
        if (!value)
            throw std::runtime_error(
                fmt::format("OFF: {}: \"{}\" is not a number or is too large", item_, printable(text)));
        return *value;
    }

    std::ifstream file_;
    std::string line_, item_;
    std::string_view rest_;
};

/// Checks the OFF keyword and moves on to the counts.
void check_keyword(Lines& lines) {
    const std::string first_word(lines.word());
    if (!first_word.ends_with("OFF")) throw std::runtime_error("OFF: the file does not start with \"OFF\"");
    if (first_word.find_first_of("4n") != first_word.npos)
        throw std::runtime_error(fmt::format("OFF: \"{}\" is not three-dimensional", printable(first_word)));
    if (lines.is_over()) lines.next("the counts");
}

}  // namespace

PolygonSoup read_off(const std::filesystem::path& path) {
    Lines lines(path);
    lines.next("the header");
    check_keyword(lines);
    const auto vertices = lines.wrapped_number<std::int64_t>(), faces = lines.wrapped_number<std::int64_t>();
    PolygonSoup soup;
    for (std::int64_t v = 0; v < vertices; ++v) {
        lines.next(fmt::format("vertex {} of {}", v, vertices));
        std::array<double, 3> x;
        for (double& coordinate : x) coordinate = lines.number<double>();
        soup.X.push_back(x);
    }
    for (std::int64_t f = 0; f < faces; ++f) {
        lines.next(fmt::format("face {} of {}", f, faces));
        const auto corners = lines.number<std::int64_t>();
        for (std::int64_t c = 0; c < corners; ++c)
            soup.corners.push_back(lines.wrapped_number<std::int64_t>());
        soup.face_end.push_back(soup.corners.size());
    }
    return soup;
}

}  // namespace nbd

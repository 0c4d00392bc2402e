#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "meshing/formats/surface_formats.hpp"
#include "meshing/formats/words.hpp"

namespace nbd {
namespace {

constexpr std::string_view obj_white = " \t\v\f";

/// Takes the next word of a line; empty at its end.
std::string_view take_word(std::string_view& line) {
    line.remove_prefix(std::min(line.find_first_not_of(obj_white), line.size()));
    const std::string_view word = line.substr(0, line.find_first_of(obj_white));
    line.remove_prefix(word.size());
    return word;
}

/// The number may have a decimal comma.
std::optional<double> number(std::string_view word) {
    if (const auto value = number_in<double>(word)) return value;
    std::string with_point(word);
    std::ranges::replace(with_point, ',', '.');
    return number_in<double>(with_point);
}

/// Index of the vertex in a corner such as 3, 3/1 or -1//2; empty if it is no whole number.
std::optional<std::int64_t> vertex_index(std::string_view corner) {
    return number_in<std::int64_t>(corner.substr(0, corner.find('/')));
}

/// Follows the lines of a file.
class ObjReader {
 public:
    /// Carriage returns end lines, too. After a backslash at its end a line goes on, even a comment.
    void line(std::string_view text) {
        if (text.ends_with('\r')) text.remove_suffix(1);
        for (;;) {
            ++number_;
            const std::size_t end = text.find('\r');
            part(text.substr(0, end));
            if (end == text.npos) return;
            text.remove_prefix(end + 1);
        }
    }

    PolygonSoup end() {
        if (!begun_.empty()) statement(begun_, begun_number_);
        if (farthest_ > vertex_count())
            fail(farthest_line_, fmt::format("the face refers to vertex {}, but the file has {} vertices",
                                             farthest_, vertex_count()));
        return in_order_of_faces();
    }

 private:
    [[noreturn]] static void fail(std::int64_t number, const std::string& what) {
        throw std::runtime_error(fmt::format("line {}: {}", number, what));
    }

    void part(std::string_view text) {
        const bool goes_on = text.ends_with('\\');
        if (goes_on) text.remove_suffix(1);
        if (begun_.empty() && !goes_on) return statement(text, number_);
        if (begun_.empty()) begun_number_ = number_;
        begun_.append(text).append(" ");
        if (goes_on) return;
        statement(begun_, begun_number_);
        begun_.clear();
    }

    void statement(std::string_view text, std::int64_t at) {
        text.remove_prefix(std::min(text.find_first_not_of(obj_white), text.size()));
        if (text.starts_with('g') || text.starts_with('o') || text.starts_with('u'))
            return begin_groups(text);
        if (text.size() < 2 || (text[0] != 'v' && text[0] != 'f') ||
            obj_white.find(text[1]) == obj_white.npos)
            return;
        const bool is_vertex = text[0] == 'v';
        text = text.substr(1, text.find('#') - 1);
        is_vertex ? add_vertex(text, at) : add_face(text, at);
    }

    /// A line of names that belong to the faces after it. `g` may have several; the name of `o` or `usemtl`
    /// may have spaces in it.
    void begin_groups(std::string_view text) {
        const std::string_view kind = take_word(text);
        if (kind != "g" && kind != "o" && kind != "usemtl") return;
        std::vector<int>& current = current_[std::string(kind)];
        current.clear();
        const auto add = [&](std::string_view name) {
            if (name.empty()) return;
            const auto [known, is_new] =
                number_of_group_.try_emplace(std::string(name), std::ssize(soup_.groups));
            if (is_new) soup_.groups.push_back({.name = std::string(name), .faces = {}});
            current.push_back(known->second);
        };
        if (kind == "g") {
            for (std::string_view name = take_word(text); !name.empty(); name = take_word(text)) add(name);
            return;
        }
        text.remove_prefix(std::min(text.find_first_not_of(obj_white), text.size()));
        add(text.substr(0, text.find_last_not_of(obj_white) + 1));
    }

    void add_vertex(std::string_view text, std::int64_t at) {
        std::size_t count = 0;
        std::array<double, 4> x{};
        for (std::string_view word = take_word(text); !word.empty(); word = take_word(text), ++count) {
            const auto value = number(word);
            if (!value) fail(at, fmt::format("the vertex has '{}'; allowed: numbers", printable(word)));
            if (count < x.size()) x[count] = *value;
        }
        if (count != 3 && count != 4 && count != 6)
            fail(at, fmt::format("the vertex has {} number{}; allowed: 3, 4 with a weight, or 6 with a "
                                 "colour",
                                 count, count == 1 ? "" : "s"));
        if (count == 4 && x[3] == 0) fail(at, "the vertex has the weight 0; allowed: other weights");
        const double weight = count == 4 ? x[3] : 1;
        all_.push_back({x[0] / weight, x[1] / weight, x[2] / weight});
    }

    void add_face(std::string_view text, std::int64_t at) {
        for (std::string_view word = take_word(text); !word.empty(); word = take_word(text)) {
            const std::optional<std::int64_t> index = vertex_index(word);
            if (!index)
                fail(at, fmt::format("the face has '{}'; allowed: corners such as 3, 3/1 or 3/1/2",
                                     printable(word)));
            if (*index == 0) fail(at, "the face refers to vertex 0; allowed: from 1 on, or from -1 back");
            if (*index < -vertex_count())
                fail(at, fmt::format("the face refers to vertex {}, but {} vertices come before it", *index,
                                     vertex_count()));
            if (*index > farthest_) {
                farthest_ = *index;
                farthest_line_ = at;
            }
            soup_.corners.push_back(*index > 0 ? *index - 1 : vertex_count() + *index);
        }
        const int face = static_cast<int>(soup_.face_end.size());
        soup_.face_end.push_back(soup_.corners.size());
        for (const auto& [kind, groups] : current_)
            for (const int group : groups)
                if (std::vector<int>& faces = soup_.groups[group].faces; faces.empty() || faces.back() < face)
                    faces.push_back(face);
    }

    /// Numbers the vertices anew and leaves out those that no face has.
    PolygonSoup in_order_of_faces() {
        std::vector<std::int64_t> row(all_.size(), -1);
        for (std::int64_t& corner : soup_.corners) {
            std::int64_t& mine = row[corner];
            if (mine < 0) {
                mine = soup_.X.size();
                soup_.X.push_back(all_[corner]);
            }
            corner = mine;
        }
        return std::move(soup_);
    }

    std::int64_t vertex_count() const { return all_.size(); }

    std::vector<std::array<double, 3>> all_;
    PolygonSoup soup_;                                 // until the end with corners among all vertices
    std::map<std::string, std::vector<int>> current_;  // numbers of the groups by the kind of line
    std::map<std::string, int> number_of_group_;
    std::int64_t number_ = 0;
    std::string begun_;  // a line that goes on
    std::int64_t begun_number_ = 0;
    std::int64_t farthest_ = 0, farthest_line_ = 0;  // the largest index of a face, and where it is
};

}  // namespace

PolygonSoup read_obj(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    ObjReader reader;
    std::string line;
    while (std::getline(file, line)) reader.line(line);
    return reader.end();
}

}  // namespace nbd

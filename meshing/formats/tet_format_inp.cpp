// Meshes of CalculiX and Abaqus.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "meshing/formats/tet_formats.hpp"
#include "meshing/formats/words.hpp"

namespace nbd {
namespace {

std::string_view stripped(std::string_view text) {
    constexpr std::string_view blank = " \t\r\"";
    text.remove_prefix(std::min(text.find_first_not_of(blank), text.size()));
    return text.substr(0, text.find_last_not_of(blank) + 1);  // npos + 1 is 0
}

/// The cells of a line with commas between them; none behind the last comma.
std::vector<std::string_view> cells_of(std::string_view line) {
    std::vector<std::string_view> cells;
    while (!stripped(line).empty()) {
        const std::size_t comma = std::min(line.find(','), line.size());
        cells.push_back(stripped(line.substr(0, comma)));
        line.remove_prefix(std::min(comma + 1, line.size()));
    }
    return cells;
}

/// Number of corners of a flat element, or of nodes of a line or point; 0: another one, a volume or unusual.
int nodes_of_flat(const std::string& type) {
    constexpr std::pair<const char*, int> types[]{
        {"S3", 3},       {"STRI3", 3},   {"M3D3", 3}, {"SFM3D3", 3},  {"CPS3", 3},   {"CPE3", 3},
        {"CAX3", 3},     {"S4", 4},      {"M3D4", 4}, {"CPS4", 4},    {"CPE4", 4},   {"CAX4", 4},
        {"S6", 6},       {"STRI65", 6},  {"M3D6", 6}, {"CPS6", 6},    {"CPE6", 6},   {"CAX6", 6},
        {"S8", 8},       {"M3D8", 8},    {"CPS8", 8}, {"CPE8", 8},    {"CAX8", 8},   {"B21", 2},
        {"B31", 2},      {"T2D2", 2},    {"T3D2", 2}, {"B32", 3},     {"T3D3", 3},   {"GAPUNI", 2},
        {"DASHPOTA", 2}, {"SPRINGA", 2}, {"MASS", 1}, {"SPRING1", 1}, {"SPRING2", 2}};
    const std::string plain = type.ends_with('R') ? type.substr(0, type.size() - 1) : type;
    for (const auto& [name, nodes] : types)
        if (plain == name) return nodes;
    return 0;
}

class InpReader {
 public:
    explicit InpReader(FileCursor& in) : in_(in) {}

    TetFileContent read() {
        while (in_.bytes_left() > 0) {
            const std::string_view line = next_line();
            if (line.empty()) continue;
            if (line.front() == '*')
                read_keyword(line);
            else if (lines_)
                (this->*lines_)(cells_of(line));
            else if (!has_keyword_)
                in_.fail("not a mesh of CalculiX: it does not begin with a keyword such as *NODE");
        }
        finish_element();
        if (content_.tets.empty() && content_.nodes.empty()) in_.fail("the file has no *NODE");
        give_groups();
        return std::move(content_);
    }

 private:
    struct Element {
        bool is_tet = false;
        int index = -1;  // of a tetrahedron or a triangle; -1: another one
    };
    struct Set {
        std::string name;       // as the file has it first
        std::vector<int> rows;  // of nodes, or places in elements_
    };
    using Sets = std::deque<Set>;  // whose members keep their places
    using Cells = std::vector<std::string_view>;

    /// The next line without comments, stripped.
    std::string_view next_line() {
        const std::string_view line = stripped(in_.line());
        return line.starts_with("**") ? std::string_view{} : line;
    }

    std::string option(std::string_view key) const {
        const auto found = options_.find(std::string(key));
        return found == options_.end() ? std::string{} : found->second;
    }

    void read_keyword(std::string_view line) {
        finish_element();
        has_keyword_ = true;
        lines_ = nullptr;
        options_.clear();
        Cells cells = cells_of(line.substr(1));
        // The options may go on in the next line.
        while (line.ends_with(',') && in_.bytes_left() > 0) {
            line = next_line();
            for (const std::string_view cell : cells_of(line)) cells.push_back(cell);
        }
        const std::string keyword = cells.empty() ? std::string{} : capitals(cells[0]);
        for (std::size_t i = 1; i < cells.size(); ++i) {
            const std::size_t equal = std::min(cells[i].find('='), cells[i].size());
            const std::string key = capitals(stripped(cells[i].substr(0, equal)));
            options_[key] = stripped(cells[i].substr(std::min(equal + 1, cells[i].size())));
        }
        if (keyword == "NODE") begin_nodes();
        if (keyword == "ELEMENT") begin_elements();
        if (keyword == "NSET" || keyword == "ELSET") begin_set(keyword);
        if (keyword == "SURFACE") begin_surface();
        if (keyword == "INCLUDE") in_.fail("*INCLUDE is not followed; allowed: a mesh in one file");
    }

    std::string needed(std::string_view keyword, std::string_view key) {
        std::string value = option(key);
        if (value.empty()) in_.fail(fmt::format("*{} has no {}=", keyword, key));
        return value;
    }

    /// The set of a name, whatever its capitals, which is made if it is not there.
    static Set& set_of(Sets& sets, const std::string& name) {
        const auto found = find_set(sets, name);
        if (found != sets.end()) return *found;
        return sets.emplace_back(Set{name, {}});
    }
    /// Its rows; null without a name.
    static std::vector<int>* rows_of(Sets& sets, const std::string& name) {
        return name.empty() ? nullptr : &set_of(sets, name).rows;
    }
    static Sets::iterator find_set(Sets& sets, std::string_view name) {
        return std::ranges::find_if(sets,
                                    [&](const Set& set) { return capitals(set.name) == capitals(name); });
    }

    std::int64_t whole(std::string_view cell, const char* what) {
        const auto number = number_in<std::int64_t>(cell);
        if (!number) in_.fail(fmt::format("'{}' is no {}", printable(cell), what));
        return *number;
    }

    int node_row(std::string_view cell) {
        const std::int64_t id = whole(cell, "number of a node");
        const auto found = row_of_node_.find(id);
        if (found == row_of_node_.end()) in_.fail(fmt::format("node {} is not in the file", id));
        return found->second;
    }

    void begin_nodes() {
        lines_ = &InpReader::read_node;
        rows_ = rows_of(node_sets_, option("NSET"));
    }
    void read_node(const Cells& cells) {
        if (cells.size() < 2) in_.fail("a node needs a number and coordinates");
        std::array<double, 3> place{};
        for (std::size_t k = 1; k < std::min<std::size_t>(cells.size(), 4); ++k) {
            std::string word(cells[k]);
            std::ranges::replace_if(
                word, [](char c) { return c == 'D' || c == 'd'; }, 'e');
            const auto number = number_in<double>(word);
            if (!number) in_.fail(fmt::format("'{}' is no coordinate", printable(cells[k])));
            place[k - 1] = *number;
        }
        const std::int64_t id = whole(cells[0], "number of a node");
        const int row = static_cast<int>(content_.nodes.size());
        if (!row_of_node_.emplace(id, row).second) in_.fail(fmt::format("node {} is there twice", id));
        content_.nodes.push_back(place);
        if (rows_) rows_->push_back(row);
    }

    void begin_elements() {
        lines_ = &InpReader::read_element;
        rows_ = rows_of(element_sets_, option("ELSET"));
        const std::string type = capitals(needed("ELEMENT", "TYPE"));
        is_tet_ = type == "C3D4";
        nodes_wanted_ = is_tet_ ? 4 : nodes_of_flat(type);
        is_triangle_ = nodes_wanted_ == 3 && !type.starts_with('B') && !type.starts_with('T');
        if (nodes_wanted_ == 0)
            in_.fail(
                fmt::format("elements are of type {}; only 4-node tetrahedra (C3D4) are allowed, and flat "
                            "elements and lines beside them",
                            printable(type)));
    }
    /// An element may go on in the next line.
    void read_element(const Cells& cells) {
        element_cells_.insert(element_cells_.end(), cells.begin(), cells.end());
        if (std::ssize(element_cells_) > nodes_wanted_) finish_element();
    }
    void finish_element() {
        if (element_cells_.empty()) return;
        const std::vector<std::string> cells(element_cells_.begin(), element_cells_.end());
        element_cells_.clear();
        const std::int64_t id = whole(cells[0], "number of an element");
        if (std::ssize(cells) - 1 != nodes_wanted_)
            in_.fail(
                fmt::format("element {} has {} nodes; allowed: {}", id, cells.size() - 1, nodes_wanted_));
        Element element{.is_tet = is_tet_, .index = -1};
        if (is_tet_) {
            std::array<int, 4> tet{};
            for (std::size_t k = 0; k < 4; ++k) tet[k] = node_row(cells[k + 1]);
            element.index = static_cast<int>(content_.tets.size());
            content_.tets.push_back(tet);
        } else {
            ++content_.other_cells;
            if (is_triangle_) {
                std::array<int, 3> triangle{};
                for (std::size_t k = 0; k < 3; ++k) triangle[k] = node_row(cells[k + 1]);
                element.index = static_cast<int>(triangles_.size());
                triangles_.push_back(triangle);
            }
        }
        const int place = static_cast<int>(elements_.size());
        if (!place_of_element_.emplace(id, place).second)
            in_.fail(fmt::format("element {} is there twice", id));
        elements_.push_back(element);
        if (rows_) rows_->push_back(place);
    }

    void begin_set(const std::string& keyword) {
        is_of_nodes_ = keyword == "NSET";
        rows_ = rows_of(is_of_nodes_ ? node_sets_ : element_sets_, needed(keyword, keyword));
        lines_ = options_.contains("GENERATE") ? &InpReader::generate : &InpReader::read_members;
    }
    /// Numbers, or names of other sets.
    void read_members(const Cells& cells) {
        for (const std::string_view cell : cells) add_member(cell);
    }
    void add_member(std::string_view cell) {
        const std::vector<int> rows = members_of(cell, is_of_nodes_);
        rows_->insert(rows_->end(), rows.begin(), rows.end());
    }
    /// The rows of a node or an element, by its number, or of a set of them, by its name.
    std::vector<int> members_of(std::string_view cell, bool of_nodes) {
        Sets& sets = of_nodes ? node_sets_ : element_sets_;
        const auto& numbers = of_nodes ? row_of_node_ : place_of_element_;
        if (const auto number = number_in<std::int64_t>(cell)) {
            const auto found = numbers.find(*number);
            if (found == numbers.end())
                in_.fail(fmt::format("{} {} is not in the file", of_nodes ? "node" : "element", *number));
            return {found->second};
        }
        const auto set = find_set(sets, cell);
        if (set == sets.end())
            in_.fail(fmt::format("'{}' is neither {} nor a set of them", printable(cell),
                                 of_nodes ? "a node" : "an element"));
        return set->rows;
    }
    /// The first number, the last and the step.
    void generate(const Cells& cells) {
        if (cells.size() < 2) in_.fail("GENERATE needs a first and a last number");
        const std::int64_t first = whole(cells[0], "number"), last = whole(cells[1], "number"),
                           step = cells.size() > 2 ? whole(cells[2], "number") : 1;
        if (step < 1) in_.fail(fmt::format("the step of GENERATE is {}; allowed: at least 1", step));
        if (first < 0 || last < first)
            in_.fail(
                fmt::format("GENERATE goes from {} to {}; allowed: upwards from 0 or more", first, last));
        const auto& numbers = is_of_nodes_ ? row_of_node_ : place_of_element_;
        if ((last - first) / step < std::ssize(numbers)) {
            for (std::int64_t number = first; number <= last; number += step) {
                if (const auto found = numbers.find(number); found != numbers.end())
                    rows_->push_back(found->second);
                if (number > last - step) break;
            }
            return;
        }
        for (const auto& [number, row] : numbers)
            if (number >= first && number <= last && (number - first) % step == 0) rows_->push_back(row);
    }

    void begin_surface() {
        surface_ = needed("SURFACE", "NAME");
        const std::string type = capitals(option("TYPE"));
        if (type == "NODE") {
            is_of_nodes_ = true;
            rows_ = rows_of(node_sets_, surface_);
            lines_ = &InpReader::read_members;
        } else if (type.empty() || type == "ELEMENT") {
            lines_ = &InpReader::read_face;
        }
    }
    /// An element or a set of them, and a side of it.
    void read_face(const Cells& cells) {
        if (cells.empty()) return;
        const std::string side = cells.size() > 1 ? capitals(cells[1]) : "";
        for (const int place : members_of(cells[0], false)) {
            const Element& element = elements_[place];
            if (element.index < 0) continue;
            if (!element.is_tet) {
                faces_.emplace_back(surface_, triangles_[element.index]);
                continue;
            }
            constexpr std::array<std::array<int, 3>, 4> sides{{{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}};
            const int number = side.size() == 2 && side[0] == 'S' ? side[1] - '1' : -1;
            if (number < 0 || number > 3)
                in_.fail(fmt::format("'{}' is no side of a tetrahedron; allowed: S1 to S4",
                                     cells.size() > 1 ? printable(cells[1]) : ""));
            const auto& tet = content_.tets[element.index];
            std::array<int, 3> face{};
            for (std::size_t k = 0; k < 3; ++k) face[k] = tet[sides[number][k]];
            faces_.emplace_back(surface_, face);
        }
    }

    /// Number of a group of triangles.
    int triangle_group(const std::string& name) {
        auto& names = content_.triangle_group_names;
        for (const auto& [number, known] : names)
            if (capitals(known) == capitals(name)) return number;
        const int number = static_cast<int>(names.size()) + 1;
        names[number] = name;
        return number;
    }
    void add_triangle(const std::string& name, const std::array<int, 3>& triangle) {
        content_.triangles.push_back(triangle);
        content_.group_of_triangle.push_back(triangle_group(name));
    }

    void give_groups() {
        content_.group_of_tet.assign(content_.tets.size(), 0);
        int number = 0;
        for (const Set& set : element_sets_) {
            std::vector<int> tets;
            for (const int place : set.rows) {
                const Element& element = elements_[place];
                if (element.index < 0) continue;
                if (element.is_tet)
                    tets.push_back(element.index);
                else
                    add_triangle(set.name, triangles_[element.index]);
            }
            std::ranges::sort(tets);
            tets.erase(std::unique(tets.begin(), tets.end()), tets.end());
            if (tets.empty() || tets.size() == content_.tets.size()) continue;  // all of them are no group
            content_.group_names[++number] = set.name;
            std::size_t taken = 0;
            for (const int tet : tets)
                if (content_.group_of_tet[tet] == 0)
                    content_.group_of_tet[tet] = number;
                else
                    ++taken;
            if (taken > 0)
                content_.notes.push_back(
                    fmt::format("{} of {} tetrahedra of set {} are in an earlier set, for which they count",
                                taken, tets.size(), set.name));
        }
        for (const auto& [name, face] : faces_) add_triangle(name, face);
        for (Set& set : node_sets_) {
            bool is_known = false;
            for (const auto& [known, name] : content_.triangle_group_names)
                is_known = is_known || capitals(name) == capitals(set.name);
            if (!is_known) content_.node_sets.push_back({set.name, std::move(set.rows)});
        }
    }

    FileCursor& in_;
    TetFileContent content_;
    bool has_keyword_ = false;
    void (InpReader::*lines_)(const Cells&) = nullptr;  // reads the lines of the keyword; null: skips them
    std::map<std::string, std::string> options_;        // of the keyword, by capitals
    std::vector<int>* rows_ = nullptr;                  // of the set that the lines add to; null: none
    bool is_of_nodes_ = false;                          // whether it is one of nodes
    std::string surface_;                               // that the lines add to
    bool is_tet_ = false, is_triangle_ = false;         // the elements
    int nodes_wanted_ = 0;
    std::vector<std::string> element_cells_;  // of an element that may go on
    std::unordered_map<std::int64_t, int> row_of_node_, place_of_element_;
    std::vector<Element> elements_;
    std::vector<std::array<int, 3>> triangles_;
    Sets node_sets_, element_sets_;
    std::vector<std::pair<std::string, std::array<int, 3>>> faces_;  // of surfaces, with their names
};

}  // namespace

TetFileContent read_inp(FileCursor& in) { return InpReader(in).read(); }

}  // namespace nbd

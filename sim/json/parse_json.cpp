#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <stdexcept>

#include "collision/base/shortened.hpp"
#include "sim/json/json_object.hpp"

namespace nbd {
namespace {

constexpr std::size_t max_depth = 100;  // far more than any of our files has

std::string for_message(std::string_view text) { return shortened(text, 300); }

/// Follows a parser through a text, refuses deep nesting and keeps the path of the first duplicate key of an
/// object. JSON allows duplicates, and parsers silently keep the last.
class DuplicateKeys {
 public:
    using Event = nlohmann::json::parse_event_t;

    bool operator()(Event event, const nlohmann::json& value) {
        switch (event) {
            case Event::object_start:
            case Event::array_start:
                count_element();
                if (open_.size() == max_depth)
                    throw std::invalid_argument(
                        fmt::format("values are nested too deeply; allowed: at most {} levels", max_depth));
                open_.push_back({.is_array = event == Event::array_start});
                break;
            case Event::object_end:
            case Event::array_end:
                open_.pop_back();
                break;
            case Event::key:
                open_.back().key = value.get<std::string>();
                if (!open_.back().keys.insert(open_.back().key).second && !first_) first_ = path();
                break;
            case Event::value:
                count_element();
                break;
        }
        return true;
    }
    const std::optional<std::string>& first() const { return first_; }

 private:
    struct Level {
        bool is_array = false;
        int index = -1;
        std::string key{};
        std::set<std::string> keys{};
    };

    void count_element() {
        if (!open_.empty() && open_.back().is_array) ++open_.back().index;
    }
    std::string path() const {
        std::string path;
        for (const Level& level : open_)
            path += level.is_array ? fmt::format("[{}]", level.index) : (path.empty() ? "" : ".") + level.key;
        return path;
    }

    std::vector<Level> open_;
    std::optional<std::string> first_;
};

}  // namespace

nlohmann::json parse_json(std::string_view text) {
    try {
        DuplicateKeys twice;
        nlohmann::json value =
            nlohmann::json::parse(text, [&](int, DuplicateKeys::Event event, const nlohmann::json& parsed) {
                return twice(event, parsed);
            });
        if (twice.first())
            throw std::invalid_argument(for_message(*twice.first()) + ": this key occurs twice");
        return value;
    } catch (const nlohmann::json::parse_error& error) {
        const auto before = text.substr(0, std::min(text.size(), error.byte > 0 ? error.byte - 1 : 0));
        const auto line = 1 + std::ranges::count(before, '\n');
        const auto line_start = before.rfind('\n');
        const std::size_t column =
            before.size() - (line_start == std::string_view::npos ? 0 : line_start + 1) + 1;
        std::string what = error.what();
        // In front stands the position, which the message has already.
        if (const auto detail = what.find("syntax error"); detail != std::string::npos) what.erase(0, detail);
        std::ranges::replace(what, '\n', ' ');
        throw std::invalid_argument(fmt::format("line {}, column {}: {}", line, column, for_message(what)));
    } catch (const nlohmann::json::out_of_range& error) {  // a number beyond double; has no position
        const std::string_view what = error.what();
        throw std::invalid_argument(for_message(what.substr(std::min(what.find("] "), what.size() - 2) + 2)));
    }
}

std::string without_comments(std::string_view text) {
    std::string result(text);
    bool in_text = false;
    for (std::size_t i = 0; i < result.size(); ++i) {
        if (in_text && result[i] == '\\') {
            ++i;  // what is escaped
        } else if (result[i] == '"') {
            in_text = !in_text;
        } else if (!in_text && (text.substr(i, 2) == "//" || text.substr(i, 2) == "/*")) {
            const bool is_line = text[i + 1] == '/';
            const std::size_t end = text.find(is_line ? "\n" : "*/", i + 2);
            if (end == text.npos && !is_line)
                throw std::invalid_argument(fmt::format(
                    "line {}: a comment begins with /* and does not end; allowed: one that ends with */",
                    1 + std::ranges::count(text.substr(0, i), '\n')));
            const std::size_t past = end == text.npos ? text.size() : is_line ? end : end + 2;
            for (; i < past; ++i)
                if (result[i] != '\n') result[i] = ' ';
            --i;
        }
    }
    return result;
}

}  // namespace nbd

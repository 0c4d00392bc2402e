#include "apps/bench/measure/rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/bench/measure/measure.hpp"
#include "meshing/formats/words.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

using Value = nlohmann::ordered_json;

/// digits: of numbers that are not whole.
std::string plain(const Value& value, int digits) {
    if (value.is_null()) return "";
    if (value.is_string()) return value.get<std::string>();
    if (value.is_boolean()) return value.get<bool>() ? "1" : "0";
    if (!value.is_number_float()) return value.dump();
    const double number = value.get<double>();
    const bool is_long = std::abs(number) >= std::pow(10, digits) - 0.5 && std::abs(number) < 1e15;
    return is_long ? fmt::format("{:.0f}", number) : fmt::format("{:.{}g}", number, digits);
}

}  // namespace

void write_csv(const std::filesystem::path& path, const Rows& rows) {
    h5::AtomicFile file(path);
    file.out() << "# " << this_machine() << '\n';
    std::vector<std::string> cells;
    const auto end_line = [&] {
        file.out() << fmt::format("{}\n", fmt::join(cells, ","));
        cells.clear();
    };
    if (!rows.empty())
        for (const auto& [key, value] : rows.front().items()) cells.push_back(key);
    end_line();
    for (const Value& row : rows) {
        for (const Value& value : row) cells.push_back(csv_cell(plain(value, 9)));
        end_line();
    }
    file.commit();
}

std::string to_text(const Rows& rows, const std::vector<std::string>& keys) {
    std::vector<std::string> lines(rows.size() + 1);
    for (const std::string& key : keys) {
        std::vector<std::string> cells{key};
        bool is_text = false;
        for (const Value& row : rows) {
            cells.push_back(plain(row.at(key), 3));
            is_text = is_text || row.at(key).is_string();
        }
        const std::size_t width = std::ranges::max(cells, {}, &std::string::size).size();
        for (std::size_t i = 0; i < cells.size(); ++i)
            lines[i] +=
                is_text ? fmt::format("{:<{}}  ", cells[i], width) : fmt::format("{:>{}}  ", cells[i], width);
    }
    for (std::string& line : lines) line.erase(line.find_last_not_of(' ') + 1);
    return fmt::format("{}", fmt::join(lines, "\n"));
}

long sum_of(const Rows& rows, const std::string& key) {
    long sum = 0;
    for (const Value& row : rows) sum += row.at(key).get<long>();
    return sum;
}

}  // namespace nbd

#include "apps/bench/continuous/impact_queries.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string_view>

namespace nbd {
namespace {

using Row = std::array<double, 7>;

/// Seven numbers separated by commas. Whole numbers of any length are read to double; those of a fraction
/// that is a double are exact, as one of them is a power of two.
Row read_row(const std::string& line, const std::filesystem::path& file, int number) {
    Row row{};
    const char* at = line.c_str();
    for (std::size_t k = 0; k < row.size(); ++k) {
        char* end = nullptr;
        row[k] = std::strtod(at, &end);
        const bool separated = k + 1 == row.size() ? *end == '\0' || *end == '\r' : *end == ',';
        if (end == at || !separated || !std::isfinite(row[k]))
            throw std::runtime_error(fmt::format(
                "{}, line {}: allowed: seven whole numbers separated by commas", file.string(), number));
        at = end + 1;
    }
    if (row[1] == 0 || row[3] == 0 || row[5] == 0 || (row[6] != 0 && row[6] != 1))
        throw std::runtime_error(
            fmt::format("{}, line {}: allowed: denominators other than 0, and an answer of 0 or 1",
                        file.string(), number));
    return row;
}

void read_file(const std::filesystem::path& file, ImpactQueries& into) {
    constexpr int corners = 4, rows = 2 * corners;
    std::ifstream in(file);
    if (!in) throw std::runtime_error(fmt::format("{}: cannot be read", file.string()));
    ImpactCorners query;
    int number = 0;
    for (std::string line; std::getline(in, line); ++number) {
        const Row row = read_row(line, file, number + 1);
        const int k = number % rows;
        MovingPoint& corner = query[static_cast<std::size_t>(k % corners)];
        (k < corners ? corner.begin : corner.end) << row[0] / row[1], row[2] / row[3], row[4] / row[5];
        if (k + 1 < rows) continue;
        into.queries.push_back(query);
        into.collides.push_back(row[6] == 1);
    }
    if (number % rows != 0)
        throw std::runtime_error(
            fmt::format("{}: {} lines; allowed: a multiple of {}", file.string(), number, rows));
}

std::vector<std::filesystem::path> sorted_entries(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> entries;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) entries.push_back(entry.path());
    std::ranges::sort(entries);
    return entries;
}

}  // namespace

std::vector<ImpactQueries> read_impact_queries(const std::filesystem::path& folder) {
    std::vector<ImpactQueries> result;
    for (const auto& scene : sorted_entries(folder))
        for (const FeatureKind kind : {FeatureKind::edge_edge, FeatureKind::vertex_face}) {
            const auto files = scene / (kind == FeatureKind::edge_edge ? "edge-edge" : "vertex-face");
            if (!std::filesystem::is_directory(files)) continue;
            ImpactQueries queries{.scene = scene.filename().string(), .kind = kind};
            for (const auto& file : sorted_entries(files))
                if (file.extension() == ".csv") read_file(file, queries);
            if (!queries.queries.empty()) result.push_back(std::move(queries));
        }
    if (result.empty())
        throw std::runtime_error(fmt::format(
            "{}: no queries; allowed: a folder with SCENE/edge-edge/*.csv or SCENE/vertex-face/*.csv",
            folder.string()));
    return result;
}

}  // namespace nbd

#include "apps/bench/exactness/impacts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "apps/bench/measure/measure.hpp"
#include "collision/base/counter_random.hpp"
#include "collision/base/stopwatch.hpp"

namespace nbd {
namespace {

constexpr int repetitions = 5;

using Motion = std::array<MovingPoint, 4>;

const char* name(FeatureKind kind) { return kind == FeatureKind::vertex_face ? "vertex-face" : "edge-edge"; }

double distance_at(FeatureKind kind, const Motion& x, double time) {
    std::array<Eigen::Vector3d, 4> y;
    for (std::size_t k = 0; k < 4; ++k) y[k] = (1 - time) * x[k].begin + time * x[k].end;
    return closest_points(kind, y).distance;
}

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
    Motion query;
    int number = 0;
    for (std::string line; std::getline(in, line); ++number) {
        const Row row = read_row(line, file, number + 1);
        const int k = number % rows;
        MovingPoint& corner = query[k % corners];
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

Rows score_impacts(std::span<const ImpactQueries> queries) {
    Rows rows;
    for (const ImpactQueries& some : queries) {
        const std::size_t count = some.queries.size();
        std::vector<Impact> impacts(count);
        std::vector<double> times;
        for (int r = 0; r < repetitions; ++r) {
            const Stopwatch watch;
            for (std::size_t i = 0; i < count; ++i)
                impacts[i] = feature_impact(some.kind, some.queries[i], {});
            times.push_back(1e3 * watch.microseconds() / static_cast<double>(count));
        }
        long collisions = 0, missed = 0, false_alarms = 0, exhausted = 0, iterations = 0;
        int most_iterations = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const bool truth = some.collides[i] != 0, hits = impacts[i].hits;
            collisions += truth;
            missed += truth && !hits;
            false_alarms += hits && !truth;
            exhausted += impacts[i].exhausted;
            iterations += impacts[i].iterations;
            most_iterations = std::max(most_iterations, impacts[i].iterations);
        }
        rows.push_back({{"scene", some.scene},
                        {"kind", name(some.kind)},
                        {"queries", count},
                        {"collisions", collisions},
                        {"missed", missed},
                        {"false_alarms", false_alarms},
                        {"exhausted", exhausted},
                        {"ns", median(times)},
                        {"iterations", static_cast<double>(iterations) / static_cast<double>(count)},
                        {"most_iterations", most_iterations}});
    }
    return rows;
}

RandomImpacts check_random_impacts(long count, int samples, std::uint64_t seed,
                                   const std::function<void(long)>& done) {
    constexpr long often = 10000;
    RandomImpacts result{.queries = count};
    for (long q = 0; q < count; ++q) {
        if (q % often == 0) done(q);
        CounterRandom random(seed, q);
        const auto point = [&] {
            return Eigen::Vector3d(random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1));
        };
        Motion x;
        for (MovingPoint& corner : x) corner = {point(), point()};
        const auto kind = q % 2 == 0 ? FeatureKind::vertex_face : FeatureKind::edge_edge;
        const double separation = random.uniform(1e-4, 0.02);
        const Impact impact = feature_impact(kind, x, {.separation = separation, .tolerance = 1e-6});
        result.reported += impact.hits;
        result.exhausted += impact.exhausted;
        for (int s = 0; s <= samples; ++s) {
            const double time = static_cast<double>(s) / samples;
            if (!(distance_at(kind, x, time) < separation)) continue;
            ++result.collisions;
            result.missed += !impact.hits;
            result.late += impact.hits && impact.time > time;
            result.early += time - impact.time;
            break;
        }
    }
    if (result.collisions > 0) result.early /= result.collisions;
    return result;
}

}  // namespace nbd

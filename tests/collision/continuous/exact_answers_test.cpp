// Continuous detection against queries with exact rational coordinates and exact answers [WangEtAl21], made
// to be degenerate (Continuous-Collision-Detection/Sample-Queries): SCENE/{edge-edge,vertex-face}/*.csv,
// eight rows a query, four corners at the begin and four at the end; numerator and denominator of x, y and z,
// and the answer.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "collision/continuous/feature_pair.hpp"

namespace nbd {
namespace {

struct Score {
    int queries = 0, collisions = 0, missed = 0, false_alarms = 0, exhausted = 0;
};

/// Coordinates are rounded to double precision.
void ask(FeatureKind kind, const std::filesystem::path& file, Score& score) {
    std::ifstream in(file);
    std::array<MovingPoint, 4> x;
    int row = 0;
    for (std::string line; std::getline(in, line); row = (row + 1) % 8) {
        std::ranges::replace(line, ',', ' ');
        std::istringstream numbers(line);
        std::array<double, 7> n{};
        for (double& number : n) ASSERT_TRUE(numbers >> number) << file << ": " << line;
        (row < 4 ? x[row].begin : x[row - 4].end) << n[0] / n[1], n[2] / n[3], n[4] / n[5];
        if (row < 7) continue;
        const Impact impact = feature_impact(kind, x, {});
        const bool collides = n[6] == 1;
        ++score.queries;
        score.collisions += collides;
        score.missed += collides && !impact.hits;
        score.false_alarms += impact.hits && !collides;
        score.exhausted += impact.exhausted;
    }
    ASSERT_EQ(row, 0) << file << ": a multiple of eight rows";
}

TEST(Impact, AgreesWithExactAnswers) {
    const auto folder = std::filesystem::path(NBD_SHARED_MESHES).parent_path() / "ccd";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "needs the queries in " << folder;
    Score score;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
        if (entry.path().extension() == ".csv") {
            const bool edges = entry.path().parent_path().filename() == "edge-edge";
            ask(edges ? FeatureKind::edge_edge : FeatureKind::vertex_face, entry.path(), score);
        }
    EXPECT_EQ(score.missed, 0);
    EXPECT_GT(score.queries, 5000);
    EXPECT_GT(score.collisions, 200);
    EXPECT_LE(score.exhausted, 2);
    // These have an answer only beyond the rounding of their coordinates to double.
    EXPECT_LT(score.false_alarms, score.queries / 100);
    std::printf("%d queries, %d collide: %d missed, %d false alarms, %d ran out of iterations\n",
                score.queries, score.collisions, score.missed, score.false_alarms, score.exhausted);
}

}  // namespace
}  // namespace nbd
